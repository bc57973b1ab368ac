function [estimate, missed] = $name(u, y)
% $upper  $comment
%   $name('reset') or $name('reset', start) begins again at instant 0; start has $starts entries.
%   estimate = $name(u, y) goes on by one instant: u has $inputs known inputs ([] if none), y has
%   $measurements measurements, NaN where one did not come. missed counts those.
persistent state instant lost_so_far
transition = $transition;
injection = $injection;
readout = $readout;
$known$tables
if isempty(instant) || ischar(u)
    state = zeros($order, 1);
    instant = 0;
    lost_so_far = 0;
end
if ischar(u)
    if nargin > 1
        state(1:$starts) = y(:);
    end
    estimate = readout{1} * state;
    missed = 0;
    return
end
u = u(:);
y = y(:);
if numel(u) ~= $inputs || numel(y) ~= $measurements || any(isnan(u)) || any(isinf(u)) || any(isinf(y))
    error('$name: u must be $inputs finite numbers, y $measurements that are finite or NaN');
end
k = mod(instant, $count) + 1;
$measured
state = transition{k} * state + injection{k} * y$driven;
instant = instant + 1;
k = mod(instant, $count) + 1;
estimate = readout{k} * state;
missed = lost_so_far;
end
