% A measurement that should be there and is not is replaced by the one that is expected.
guess = expected{k} * state$through;
lost_so_far = lost_so_far + sum(isnan(y) & due{k});
left_out = isnan(y) | ~due{k};
y(left_out) = guess(left_out);
