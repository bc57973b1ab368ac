% A sample that does not come only makes the interval longer; one that is not complete is refused.
if any(isnan(y)) && ~all(isnan(y))
    error('$name: a sample must be complete, or NaN as a whole');
end
lost_so_far = lost_so_far + sum(isnan(y));
if all(isnan(y))
    instant = instant + 1;
    estimate = readout{k} * state;
    missed = lost_so_far;
    return
end
