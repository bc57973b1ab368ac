// Proofs checked by the reader's browser, in exact arithmetic: whole numbers of any size, no rounding anywhere.
// It knows the definitions of the papers, and no line of the Python that checks the same certificates.
"use strict";
(() => {
  const exact = typeof BigInt === "function";
  const [NONE, ONE] = exact ? [BigInt(0), BigInt(1)] : [];
  class Refused extends Error {}
  function demand(truth, words) { if (!truth) throw new Refused(words); }

  // ---------------------------------------------------------------- numbers and matrices
  // A matrix is whole numbers over one denominator, {a, d} with d > 0. A number is a matrix of one entry.
  const size = (whole) => (whole < NONE ? -whole : whole);
  function common(p, q) {
    [p, q] = [size(p), size(q)];
    while (q !== NONE) [p, q] = [q, p % q];
    return p;
  }
  const indices = (count) => [...Array(count).keys()];
  const rows = (M) => M.a.length;
  const columns = (M) => M.a[0].length;
  const over = (a, d) => ({ a, d });
  const number = (p, q = 1) => over([[BigInt(p)]], BigInt(q));
  const entry = (M, i, j) => over([[M.a[i][j]]], M.d);
  const mapped = (M, change) => over(M.a.map((row, i) => row.map((x, j) => change(x, i, j))), M.d);
  const zeros = (n, m) => over(indices(n).map(() => Array(m).fill(NONE)), ONE);
  const identity = (n) => mapped(zeros(n, n), (_, i, j) => (i === j ? ONE : NONE));
  const transpose = (M) => over(indices(columns(M)).map((j) => M.a.map((row) => row[j])), M.d);
  const part = (M, some, others) => over(some.map((i) => others.map((j) => M.a[i][j])), M.d);
  function reduced(M) {
    let divisor = M.d;
    for (const row of M.a) for (const x of row) if (divisor !== ONE) divisor = common(divisor, x);
    return divisor === ONE ? M : over(M.a.map((row) => row.map((x) => x / divisor)), M.d / divisor);
  }
  function plus(M, N, sign = ONE) {
    const shared = common(M.d, N.d), [f, g] = [N.d / shared, (sign * M.d) / shared];
    return over(M.a.map((row, i) => row.map((x, j) => x * f + N.a[i][j] * g)), M.d * f);
  }
  const minus = (M, N) => plus(M, N, -ONE);
  const negative = (M) => mapped(M, (x) => -x);
  const scaled = (M, c) => over(M.a.map((row) => row.map((x) => x * c.a[0][0])), M.d * c.d);
  function times(M, N) {
    const turned = transpose(N).a;
    return reduced(over(M.a.map((row) => turned.map((col) => row.reduce((sum, x, k) => sum + x * col[k], NONE))), M.d * N.d));
  }
  const product = (first, ...others) => others.reduce(times, first);
  const inverse = (c) => (c.a[0][0] < NONE ? over([[-c.d]], -c.a[0][0]) : over([[c.d]], c.a[0][0]));
  const quotient = (b, c) => times(b, inverse(c));
  const sum = (list, start = number(0)) => list.reduce((total, M) => plus(total, M), start);
  const same = (M, N) => rows(M) === rows(N) && columns(M) === columns(N)
    && minus(M, N).a.every((row) => row.every((x) => x === NONE));
  const below = (b, c) => b.a[0][0] * c.d < c.a[0][0] * b.d;
  const squares = (M) => reduced(over([[M.a.flat().reduce((total, x) => total + x * x, NONE)]], M.d * M.d));
  const power = (c, k) => indices(k).reduce((total) => times(total, c), number(1));
  // Blocks side by side; a number of rows or columns of zeros is left to `zeros`.
  function block(parts) {
    const shared = parts.flat().reduce((d, M) => (d / common(d, M.d)) * M.d, ONE);
    const raised = parts.map((line) => line.map((M) => M.a.map((row) => row.map((x) => x * (shared / M.d)))));
    return over(raised.flatMap((line) => line[0].map((_, i) => line.flatMap((M) => M[i]))), shared);
  }

  // Sylvester: a symmetric matrix is positive definite where all its leading minors are positive. The pivots of
  // elimination without fractions (Bareiss) are these minors.
  function positive(M, what) {
    demand(same(M, transpose(M)), `${what} is not symmetric`);
    const a = M.a.map((row) => row.slice());
    let before = ONE;
    for (let k = 0; k < a.length; k += 1) {
      const pivot = a[k][k];
      demand(pivot > NONE, `${what} is not positive definite: its leading minor ${k + 1} is not positive`);
      for (let i = k + 1; i < a.length; i += 1) {
        for (let j = i; j < a.length; j += 1) a[i][j] = (a[i][j] * pivot - a[k][i] * a[k][j]) / before;
      }
      before = pivot;
    }
  }

  // X with M X = N, by elimination without fractions.
  function solved(M, N, what) {
    const n = rows(M), a = M.a.map((row, i) => [...row, ...N.a[i]]);
    let before = ONE;
    for (let k = 0; k < n; k += 1) {
      const at = a.findIndex((row, i) => i >= k && row[k] !== NONE);
      demand(at >= 0, what);
      [a[k], a[at]] = [a[at], a[k]];
      const pivot = a[k][k];
      for (let i = 0; i < n; i += 1) {
        if (i === k) continue;
        const factor = a[i][k];
        a[i] = a[i].map((x, j) => (x * pivot - factor * a[k][j]) / before);
      }
      before = pivot;
    }
    const sign = before < NONE ? -ONE : ONE;
    return reduced(over(a.map((row) => row.slice(n).map((x) => x * M.d * sign)), before * sign * N.d));
  }

  // The X of a linear equation f(X) = target in matrices, found from the images of all unit matrices.
  function solvedFor(f, n, m, target, what) {
    const places = indices(n).flatMap((i) => indices(m).map((j) => [i, j]));
    const stacked = (M) => over(M.a.flat().map((x) => [x]), M.d);
    const images = places.map(([i, j]) => stacked(f(mapped(zeros(n, m), (_, r, c) => (r === i && c === j ? ONE : NONE)))));
    const found = solved(block([images]), stacked(target), what);
    return over(indices(n).map((i) => indices(m).map((j) => found.a[i * m + j][0])), found.d);
  }

  // Lyapunov: all eigenvalues of A have modulus below one where A'XA - X = -I has a positive definite solution, and
  // negative real parts where A'X + XA = -I has one.
  function settles(A, what, continuous = false) {
    const change = continuous
      ? (X) => plus(times(transpose(A), X), times(X, A)) : (X) => minus(product(transpose(A), X, A), X);
    const X = solvedFor(change, rows(A), rows(A), negative(identity(rows(A))), `${what} is not stable`);
    positive(X, `the Lyapunov matrix of ${what}`);
  }

  // Decimals: exact where the number has them, else rounded towards the safe side.
  function decimal(c, places = 7, up = false) {
    const [p, q] = [c.a[0][0], c.d], ten = BigInt(10) ** BigInt(places);
    let whole = (p * ten) / q;
    if (p * ten !== whole * q && (p > NONE) === up) whole += up ? ONE : -ONE;
    const digits = String(size(whole)).padStart(places + 1, "0");
    const text = `${digits.slice(0, -places)}.${digits.slice(-places)}`.replace(/\.?0+$/, "");
    return (whole < NONE ? "\u2212" : "") + text;
  }
  const inRows = (M) => `[${M.a.map((row, i) => row.map((_, j) => decimal(entry(M, i, j), 4)).join(" ")).join("; ")}]`;

  // ---------------------------------------------------------------- what a certificate holds
  const RATIONAL = /^(-?(?:0|[1-9][0-9]{0,999}))(?:\/([1-9][0-9]{0,999}))?$/;
  const isObject = (value) => typeof value === "object" && value !== null && !Array.isArray(value);
  function fields(value, path, names) {
    demand(isObject(value), `${path} must be an object`);
    for (const name of names) demand(Object.hasOwn(value, name), `${path} lacks the field ${name}`);
    for (const name of Object.keys(value)) demand(names.includes(name), `${path} has the unknown field ${name.slice(0, 40)}`);
    return names.map((name) => value[name]);
  }
  function list(value, path, length) {
    demand(Array.isArray(value), `${path} must be a list`);
    demand(value.length <= 40000, `${path} is too long`);
    demand(length === undefined || value.length === length, `${path} must have ${length} entries, got ${value.length}`);
    return value;
  }
  const kept = (value, truth, words) => (demand(truth, words), value);
  const integer = (value, path, least = 0) => kept(value, Number.isSafeInteger(value) && value >= least, `${path} must be a whole number, at least ${least}`);
  function rational(value, path) {
    const found = typeof value === "string" ? RATIONAL.exec(value) : null;
    demand(found, `${path} must be a fraction such as "1/3", got ${String(JSON.stringify(value)).slice(0, 40)}`);
    return number(found[1], found[2] ?? 1);
  }
  const more = (value, path, read = rational(value, path)) => kept(read, read.a[0][0] > NONE, `${path} must be positive`);
  function matrix(value, path, n, m) {
    const lines = list(value, path, n);
    demand(lines.length > 0, `${path} is empty`);
    const width = m ?? list(lines[0], `${path}[0]`).length;
    demand(width > 0, `${path} has an empty row`);
    return reduced(block(lines.map((line, i) => list(line, `${path}[${i}]`, width).map((x, j) => rational(x, `${path}[${i}][${j}]`)))));
  }
  const square = (value, path, n, read = matrix(value, path, n, n)) => kept(read, rows(read) === columns(read), `${path} must be square`);
  const symmetric = (value, path, n, read = square(value, path, n)) => kept(read, same(read, transpose(read)), `${path} is not symmetric`);
  const each = (value, path, length, read) => list(value, path, length).map((x, i) => read(x, `${path}[${i}]`));

  // JSON as it is written: a key that stands twice, a number with a point or an exponent, and anything beyond JSON are refused.
  function parsed(text) {
    demand(text.length <= 2000000, "the certificate is too large");
    const tokens = text.match(/"(?:[^"\\]|\\.)*"|[{}[\]:,]|[^\s{}[\]:,"]+/g) ?? [];
    const open = [];
    for (const [i, token] of tokens.entries()) {
      if (token === "{" || token === "[") open.push(new Set());
      else if (token === "}" || token === "]") open.pop();
      else if (tokens[i + 1] === ":") {
        demand(!open.at(-1)?.has(JSON.parse(token)), `the key ${token.slice(0, 40)} stands twice`);
        open.at(-1)?.add(JSON.parse(token));
      } else if (!token.startsWith('"') && !":,".includes(token)) {
        demand(/^(?:-?[0-9]{1,9}|true|false|null)$/.test(token), `the number ${token.slice(0, 40)} is not exact`);
      }
      demand(open.length < 60, "the certificate is nested too deeply");
    }
    return JSON.parse(text);
  }
  const ordered = (value) => JSON.stringify(value, (_, inner) => (isObject(inner)
    ? Object.fromEntries(Object.entries(inner).sort(([a], [b]) => (a < b ? -1 : 1))) : inner));

  // ---------------------------------------------------------------- a plant seen by slow sensors
  const shared = (p, q) => (q ? shared(q, p % q) : p);
  function measured(parameters) {
    const periods = each(parameters.periods, "periods", undefined, (x, path) => integer(x, path, 1));
    const offsets = each(parameters.offsets, "offsets", periods.length, integer);
    demand(periods.length > 0, "no sensor is named");
    let N = 1;
    for (const period of periods) {
      N *= period / shared(N, period);
      demand(N <= 1000, "the schedule repeats after more than 1000 instants");
    }
    return indices(N).map((k) => indices(periods.length).filter((i) => (((k - offsets[i]) % periods[i]) + periods[i]) % periods[i] === 0));
  }
  function sensed(plant, parameters, schedule = measured(parameters)) {
    const names = ["name", "A", "B_d", "C", "D", "W", ...(plant && Object.hasOwn(plant, "L") ? ["L"] : [])];
    const [, a, b, c, d, w, gains] = fields(plant, "plant", names);
    const A = square(a, "plant.A"), n = rows(A), C = matrix(c, "plant.C", undefined, n);
    const D = matrix(d, "plant.D", rows(C)), B = matrix(b, "plant.B_d", n), W = matrix(w, "plant.W", undefined, n);
    const sensors = each(parameters.sensors, "sensors", parameters.periods.length, integer);
    demand(sensors.every((i) => i < rows(C)) && new Set(sensors).size === sensors.length, "a sensor that is not there, or twice");
    const L = gains && each(gains, "plant.L", schedule.length, (x, path) => matrix(x, path, n, sensors.length));
    return { A, B, W, n, schedule, L, sensors: sensors.length, noises: columns(B) + columns(D),
      C: part(C, sensors, indices(n)), D: part(D, sensors, indices(columns(D))) };
  }

  // The error of x^+ = A x^ + L (y - C x^), a row at a time: e+ = (A - L C) e + B d - L D w over the sensors that measure.
  const shownBy = (plant, at) => [plant.C, plant.D].map((M) => part(M, at, indices(columns(M))));
  function errorStep(plant, gain, at) {
    if (!at.length) return block([[plant.A, plant.B, zeros(plant.n, columns(plant.D))]]);
    const [C, D] = shownBy(plant, at), L = part(gain, indices(plant.n), at);
    return block([[minus(plant.A, times(L, C)), plant.B, negative(times(L, D))]]);
  }

  // In each step the energy e'Pe falls by more than |z|^2 - g^2 |noise|^2. Summed from rest: |z| <= g |noise|; without
  // noise it falls, so that the error dies out.
  function energyFalls(plant, steps, P, level) {
    const { n, W } = plant, weight = times(transpose(W), W);
    P.forEach((after, k) => positive(after, `the energy matrix P at instant ${k}`));
    steps.forEach((step, k) => {
      const before = P[(k + P.length - 1) % P.length], m = columns(step) - n;
      const room = block([[minus(before, weight), zeros(n, m)], [zeros(m, n), scaled(identity(m), times(level, level))]]);
      positive(minus(room, product(transpose(step), P[k], step)), `the balance of energy at instant ${k}`);
    });
    return `At each of the ${steps.length} instants of a period the energy is positive definite, and falls by more than |z|² − g²·|noise|²: the error dies out, and its gain is at most g = ${decimal(level, 7, true)}.`;
  }
  function designed(plant, P, Y, level) {
    const steps = P.map((M, k) => errorStep(plant, solved(M, Y[k], "P has no inverse"), plant.schedule[k]));
    return `The observer with the gains L = P⁻¹Y is built. ${energyFalls(plant, steps, P, level)}`;
  }

  // A signal v R^j in period j, R orthogonal: the state that repeats like it, x(after a period) = x R, is solved exactly.
  // Then the squares of all periods are alike, and their ratio is one that the gain of a stable system is not below.
  function repeats(plant, steps, R, signal, hidden = () => number(0)) {
    const r = rows(R), n = plant.n;
    demand(r <= 2, "the turn must be of order 1 or 2");
    demand(same(times(R, transpose(R)), identity(r)), "the turn is not orthogonal");
    const run = (start, inputs) => {
      let x = start, [made, spent] = [number(0), number(0)];
      steps.forEach((step, k) => {
        made = plus(made, squares(times(plant.W, x)));
        spent = sum([spent, squares(inputs[k]), hidden(k, x)]);
        x = times(step, block([[x], [inputs[k]]]));
      });
      return { end: x, made: reduced(made), spent: reduced(spent) };
    };
    const Phi = steps.reduce((M, step) => times(part(step, indices(n), indices(n)), M), identity(n));
    const driven = run(zeros(n, r), signal).end;
    const start = solvedFor((X) => minus(times(X, R), times(Phi, X)), n, r, driven, "the signal is in resonance");
    return run(start, signal);
  }

  // The least noise that makes all sensors of an instant show zero, |w|^2 = (C x)' (D D')^-1 (C x).
  function costOfHiding(plant, at, x) {
    if (!at.length) return number(0);
    const [C, D] = shownBy(plant, at), every = indices(at.length);
    const shown = times(C, x), needed = solved(times(D, transpose(D)), shown, "a sensor has no noise of its own");
    return sum(indices(columns(x)).map((j) => product(transpose(part(shown, every, [j])), part(needed, every, [j]))));
  }
  function reaches(level, { made, spent }, words) {
    demand(below(number(0), spent), "the disturbance is zero");
    demand(!below(made, times(times(level, level), spent)), "the disturbance does not reach the lower bound");
    return words.replace("#", decimal(level));
  }
  function seenTooLate(plant, lower, start, d) {
    let x = zeros(plant.n, 1), [made, spent] = [number(0), number(0)];
    d.forEach((input, k) => {
      spent = sum([spent, squares(input), costOfHiding(plant, plant.schedule[(start + k) % plant.schedule.length], x)]);
      x = times(block([[plant.A, plant.B]]), block([[x], [input]]));
      made = plus(made, squares(times(plant.W, x)));
    });
    return reaches(lower, { made, spent }, `A disturbance of ${d.length} steps is hidden by sensor noise to its last step. A predictor cannot tell it from its opposite before, and for one of the two its error has at least # times the norm of the noise.`);
  }
  const readP = (value, plant) => each(value, "witness.P", plant.schedule.length, (x, path) => symmetric(x, path, plant.n));
  const readY = (value, plant) => each(value, "witness.Y", plant.schedule.length, (x, path) => matrix(x, path, plant.n, plant.sensors));
  const signals = (value, path, n, r, length) => each(value, path, length, (x, where) => matrix(x, where, n, r));
  const PERIODS = ["sensors", "periods", "offsets"];
  const shownPlant = (plant, gains = "") => `The plant${gains}: A = ${inRows(plant.A)}, B = ${inRows(plant.B)}, C = ${inRows(plant.C)}, D = ${inRows(plant.D)}.`;
  function level(certificate, names) {
    fields(certificate.parameters, "parameters", [...PERIODS, "relative"]);
    const plant = sensed(certificate.plant, certificate.parameters), relative = more(certificate.parameters.relative, "relative");
    const [lower, upper] = fields(certificate.bound, "bound", ["lower", "upper"]).map((x, i) => more(x, ["lower", "upper"][i]));
    demand(names.includes("v") === Boolean(plant.L), "plant.L stands where gains are given, and nowhere else");
    demand(!below(upper, lower), "the lower bound is above the upper one");
    demand(!below(times(lower, plus(number(1), relative)), upper), "the bounds are too far from each other");
    return [plant, lower, upper, ...fields(certificate.witness, "witness", names)];
  }
  const none = (certificate, ...groups) => groups.forEach((group) => fields(certificate[group], group, []));
  const PROOFS = {
    "multirate.gain"(certificate) {
      const [plant, lower, upper, p, r, v] = level(certificate, ["P", "turn", "v"]);
      const P = readP(p, plant), R = square(r, "witness.turn"), signal = signals(v, "witness.v", plant.noises, rows(R), plant.schedule.length);
      const steps = plant.L.map((L, k) => errorStep(plant, L, plant.schedule[k]));
      return { lower, upper, steps: [shownPlant(plant, " and the printed gains"), energyFalls(plant, steps, P, upper),
        reaches(lower, repeats(plant, steps, R, signal), "For a noise that repeats, the error that repeats with it is solved exactly: it has # times the norm of the noise, or more.")] };
    },
    "multirate.optimum-noncausal"(certificate) {
      const [plant, lower, upper, p, y, r, v] = level(certificate, ["P", "Y", "turn", "d"]);
      const R = square(r, "witness.turn"), d = signals(v, "witness.d", columns(plant.B), rows(R), plant.schedule.length);
      const steps = [shownPlant(plant), designed(plant, readP(p, plant), readY(y, plant), upper)];
      settles(plant.A, "the plant");
      const ratio = repeats(plant, d.map(() => block([[plant.A, plant.B]])), R, d, (k, x) => costOfHiding(plant, plant.schedule[k], x));
      return { lower, upper, steps: [...steps, "The plant is stable: its Lyapunov equation has a positive definite solution.",
        reaches(lower, ratio, "A disturbance that repeats is hidden by sensor noise: every sensor shows zero. No estimator can tell it from its opposite, and for one of the two its error has at least # times the norm of the noise.")] };
    },
    "multirate.optimum-causal"(certificate) {
      const [plant, lower, upper, p, y, start, v] = level(certificate, ["P", "Y", "start", "d"]);
      const d = signals(v, "witness.d", columns(plant.B), 1);
      return { lower, upper, steps: [shownPlant(plant), designed(plant, readP(p, plant), readY(y, plant), upper),
        seenTooLate(plant, lower, integer(start, "witness.start"), d)] };
    },
    // The gap between P before and after, weighed by Z, is never positive if P is one matrix: what is left bounds g.
    "multirate.one-matrix"(certificate) {
      fields(certificate.parameters, "parameters", PERIODS);
      const plant = sensed(certificate.plant, certificate.parameters), n = plant.n, N = plant.schedule.length;
      demand(plant.L, "plant lacks the field L");
      const lower = more(fields(certificate.bound, "bound", ["lower"])[0], "lower"), all = n + plant.noises;
      const Z = each(fields(certificate.witness, "witness", ["Z"])[0], "witness.Z", N, (x, path) => symmetric(x, path, all));
      let gained = zeros(n, n), [made, spent] = [number(0), number(0)];
      Z.forEach((M, k) => {
        positive(M, `the weight Z at instant ${k}`);
        const step = errorStep(plant, plant.L[k], plant.schedule[k]), state = part(M, indices(n), indices(n));
        gained = plus(gained, minus(product(step, M, transpose(step)), state));
        const weighed = product(plant.W, state, transpose(plant.W));
        made = sum(indices(rows(weighed)).map((i) => entry(weighed, i, i)), made);
        spent = sum(indices(plant.noises).map((i) => entry(M, n + i, n + i)), spent);
      });
      positive(gained, "what the states gain by all weights");
      return { lower, steps: [shownPlant(plant, " and the printed gains"),
        `All ${N} weights are positive definite, and so is what the states gain by them: one energy matrix for all instants cannot fall against all of them.`,
        reaches(lower, { made, spent }, "So Theorem 1 with one energy matrix gives no level below #.")] };
    },
    "multirate.shorter-periods"(certificate) {
      none(certificate, "bound");
      const [sensors, shorter, longer] = fields(certificate.parameters, "parameters", ["sensors", "shorter", "longer"]);
      const [l, p, y, start, v] = fields(certificate.witness, "witness", ["level", "P", "Y", "start", "d"]);
      const timed = (periods) => sensed(certificate.plant, { sensors, periods, offsets: list(periods, "periods", list(sensors, "sensors").length).map(() => 0) });
      const [fast, slow] = [shorter, longer].map(timed), g = more(l, "witness.level");
      demand(ordered(shorter) !== ordered(longer) && shorter.every((N, i) => N <= longer[i]), "the periods are not shorter");
      demand(shorter.every((N, i) => shorter.slice(i + 1).every((M) => shared(N, M) === 1)), "the shorter periods have a common factor");
      return { holds: false, steps: [shownPlant(slow), `With the periods ${longer.join(", ")}: ${designed(slow, readP(p, slow), readY(y, slow), g)}`,
        `With the periods ${shorter.join(", ")}: ${seenTooLate(fast, g, integer(start, "witness.start"), signals(v, "witness.d", columns(fast.B), 1))}`,
        "Shorter periods without a common factor meet in every combination, so that no other timing helps."] };
    },
    "multirate.unmeasured"(certificate) {
      fields(certificate.parameters, "parameters", ["periods", "offsets"]);
      none(certificate, "bound", "witness");
      const schedule = measured(certificate.parameters), count = certificate.parameters.periods.length;
      demand(isObject(certificate.plant) && certificate.plant.A && certificate.plant.L, "plant lacks the field A or L");
      const n = rows(square(certificate.plant.A, "plant.A"));
      const gains = each(certificate.plant.L, "plant.L", schedule.length, (x, path) => matrix(x, path, n, count));
      const others = gains.flatMap((L, k) => indices(count).filter((i) => !schedule[k].includes(i)).map((i) => part(L, indices(n), [i])));
      const wrong = others.filter((column) => !same(column, zeros(n, 1))).length;
      return { holds: !wrong, steps: [`Of the ${others.length} columns of sensors that do not measure at an instant ${wrong || "none"} ${wrong > 1 ? "are" : "is"} not zero.`] };
    },
  };

  // ---------------------------------------------------------------- the loop with a slow and a fast rate
  function loop(plant) {
    const [, a, b, c, k, l, t, m] = fields(plant, "plant", ["name", "A", "B", "C", "K", "L", "T", "M"]);
    const A = square(a, "plant.A"), n = rows(A), M = more(m, "plant.M");
    demand(M.d === ONE && M.a[0][0] <= BigInt(2000), "plant.M must be whole and at most 2000");
    return { A, n, B: matrix(b, "plant.B", n, 1), C: matrix(c, "plant.C", 1, n), K: matrix(k, "plant.K", 1, n),
      L: matrix(l, "plant.L", n, 1), T: more(t, "plant.T"), M };
  }
  const fed = (plant) => plus(plant.A, times(plant.B, plant.K));
  const watched = (plant) => minus(plant.A, times(plant.L, plant.C));

  // The equation of the paper for the joint state (x, x - estimate): J'P + PJ = -I with P > 0 exactly if J is Hurwitz.
  function lyapunov(plant, P) {
    const J = block([[fed(plant), negative(times(plant.B, plant.K))], [zeros(plant.n, plant.n), watched(plant)]]);
    demand(same(plus(times(transpose(J), P), times(P, J)), negative(identity(2 * plant.n))), "P does not solve the Lyapunov equation");
    positive(P, "P");
    return "P solves the Lyapunov equation of the paper exactly and is positive definite, so that A + BK and A − LC are Hurwitz.";
  }

  // A square root between two fractions, to 30 digits.
  function root(c) {
    const unit = BigInt(10) ** BigInt(30), wanted = (c.a[0][0] * unit * unit) / c.d;
    if (wanted === NONE) return [number(0), over([[ONE]], unit)];
    let guess = ONE << BigInt((wanted.toString(2).length >> 1) + 1);
    for (let next = (guess + wanted / guess) / BigInt(2); next < guess; next = (guess + wanted / guess) / BigInt(2)) guess = next;
    return [over([[guess]], unit), over([[guess + ONE]], unit)];
  }
  // alpha_4 lambda_max(P), the left side of (18) over T: it grows with the norms and with the largest eigenvalue of P, and
  // falls with the smallest. `side` 0 is below, 1 above.
  function conditionPerSecond(plant, smallest, largest, side) {
    const { A, B, C, K, L } = plant, norm = (M) => root(squares(M))[side], two = number(2), under = root(smallest)[1 - side];
    const output = quotient(plus(norm(times(C, A)), times(two, norm(product(C, B, K)))), under);
    const feedback = quotient(sum([times(two, norm(times(K, watched(plant)))), times(two, norm(product(K, B, K))), norm(product(K, L, C))]), under);
    const prediction = quotient(norm(times(C, A)), under);
    const parts = sum([times(feedback, norm(B)), times(norm(L), output), product(norm(B), prediction, norm(times(K, L))), times(prediction, norm(L))]);
    return quotient(product(two, parts, largest, largest), under);
  }
  function condition(plant, value) {
    const [p, l, h, least, most] = fields(value, "witness.lyapunov", ["P", "low", "high", "least", "most"]), n = 2 * plant.n;
    const P = symmetric(p, "P", n), solves = lyapunov(plant, P), [low, high] = [more(l, "low"), more(h, "high")];
    positive(minus(P, scaled(identity(n), low)), "P − low·I");
    positive(minus(scaled(identity(n), high), P), "high·I − P");
    const rayleigh = (v, path) => {
      const x = matrix(v, path, n, 1);
      demand(below(number(0), squares(x)), `${path} is zero`);
      return quotient(product(transpose(x), P, x), squares(x));
    };
    const [under, above] = [conditionPerSecond(plant, rayleigh(least, "least"), rayleigh(most, "most"), 0), conditionPerSecond(plant, low, high, 1)];
    return { solves, under, above };
  }

  // Polynomials in h = e^T - 1 as lists of numbers, lowest power first.
  const add = (p, q, sign = 1) => indices(Math.max(p.length, q.length)).map((i) => plus(p[i] ?? number(0), times(number(sign), q[i] ?? number(0))));
  const multiply = (p, q) => p.reduce((total, x, i) => add(total, [...Array(i).fill(number(0)), ...q.map((y) => times(x, y))]), []);
  const GROWTH = exact ? [number(1), number(1)] : [];

  // x' = x + u, u = K z, observer z' = -z + u + 2 y: over a fast period x becomes (1+h) x + h u, and (1+h) z becomes
  // z + h u + 2 h y; the virtual measurement (6) is (1+h) z + h u. Both are carried times (1+h)^k, so that all is polynomial.
  function determinant(K, M) {
    const h = [number(0), number(1)], columnsOfPhi = [[[number(1)], []], [[], [number(1)]]].map(([x, z]) => {
      let y = x;
      for (let k = 0; k < M; k += 1) {
        const u = multiply([K], z), seen = multiply(GROWTH, add(multiply(GROWTH, z), multiply(h, u)));
        [x, z, y] = [multiply(GROWTH, add(multiply(GROWTH, x), multiply(h, u))), add(add(z, multiply(h, u)), multiply(multiply([number(2)], h), y)), seen];
      }
      return [x, z];
    });
    const unit = indices(M).reduce((p) => multiply(p, GROWTH), [number(1)]), [[a, c], [b, d]] = columnsOfPhi;
    return add(multiply(add(unit, a, -1), add(unit, d, -1)), multiply(b, c), -1);
  }
  const onLoop = (certificate) => `The loop: A = ${inRows(certificate.A)}, B = ${inRows(certificate.B)}, C = ${inRows(certificate.C)}, K = ${inRows(certificate.K)}, L = ${inRows(certificate.L)}.`;
  Object.assign(PROOFS, {
    "dualrate.lyapunov"(certificate) {
      none(certificate, "parameters", "bound");
      const plant = loop(certificate.plant);
      return { holds: true, steps: [onLoop(plant), lyapunov(plant, symmetric(fields(certificate.witness, "witness", ["P"])[0], "P", 2 * plant.n))] };
    },
    "dualrate.hurwitz"(certificate) {
      none(certificate, "bound", "witness");
      const plant = loop(certificate.plant), [which] = fields(certificate.parameters, "parameters", ["matrix"]);
      const [name, M] = { feedback: ["A + BK", fed(plant)], observer: ["A − LC", watched(plant)] }[which] ?? [];
      demand(name, "parameters.matrix must be feedback or observer");
      settles(M, name, true);
      return { holds: true, steps: [onLoop(plant), `The Lyapunov equation of ${name} is solved: its solution is positive definite, so that all eigenvalues have negative real parts.`] };
    },
    "dualrate.condition"(certificate) {
      none(certificate, "parameters", "bound");
      const plant = loop(certificate.plant), { solves, under, above } = condition(plant, fields(certificate.witness, "witness", ["lyapunov"])[0]);
      const [least, most] = [times(under, plant.T), times(above, plant.T)], met = below(most, number(1));
      demand(met || below(number(1), least), "whether (18) holds is not decided");
      return { holds: met, steps: [onLoop(plant), solves,
        `The left side of (18) lies between ${decimal(least)} and ${decimal(most, 7, true)}: the condition is ${met ? "met" : "not met"}.`] };
    },
    "dualrate.counterexample"(certificate) {
      none(certificate, "bound");
      const plant = loop(certificate.plant), [ratios, t] = fields(certificate.parameters, "parameters", ["ratios", "longest"]);
      const longest = more(t, "longest"), { solves, under, above } = condition(plant, fields(certificate.witness, "witness", ["lyapunov"])[0]);
      demand([plant.A, plant.B, plant.C].every((M) => same(M, number(1))) && same(plant.L, number(2)), "the argument needs A = B = C = 1 and L = 2");
      demand(below(number(1), times(under, longest)), "(18) may allow longer periods");
      demand(below(longest, number(1)), "the periods are too long for this argument");
      // e^T - 1 <= T/(1 - T) below one second.
      const reach = quotient(longest, minus(number(1), longest));
      each(ratios, "ratios", undefined, (x, path) => integer(x, path, 2)).forEach((M, i) => {
        demand(M <= 100 && (!i || ratios[i - 1] < M), "the ratios must increase, to 100 at most");
        const q = determinant(plant.K, M), low = q.findIndex((c) => c.a[0][0] !== NONE);
        demand(low >= 0, "det(I − Φ) vanishes");
        const rest = sum(q.slice(low + 1).map((c, k) => (c.a[0][0] > NONE ? times(c, power(reach, k + 1)) : number(0))));
        demand(below(rest, negative(q[low])), `det(I − Φ) is not negative for every period with M = ${M}`);
      });
      demand(ratios.length > 0, "no ratio is named");
      return { holds: false, steps: [onLoop(plant), solves,
        `Condition (18) holds for every period below ${decimal(inverse(above))} s, and for none of ${decimal(inverse(under), 7, true)} s or more.`,
        `With M = ${ratios.join(", ")} the determinant of I − Φ, a polynomial in e^T − 1 with whole coefficients, is negative for every period up to ${decimal(longest)} s. So the transition Φ over a slow period has a real eigenvalue above one: the loop diverges.`,
        "All that the theorem assumes holds, and the loop diverges: the theorem is false."] };
    },
  });

  // ---------------------------------------------------------------- systems with delays
  // x' = A0 x + sum A_i x(t - tau_i) + B w, z = C10 x + sum C1_i x(t - tau_i), y = C2 x; in other coordinates if `change` is
  // given, in which C2 = [0 c].
  function delayed(given, change) {
    const [, a0, a, taus, b, c10, c1, c2] = fields(given, "plant", ["name", "A0", "A", "delays", "B", "C10", "C1", "C2"]);
    const delays = each(taus, "plant.delays", undefined, more), A0 = square(a0, "plant.A0"), n = rows(A0);
    demand(delays.length > 0 && delays.every((tau, k) => !k || below(delays[k - 1], tau)), "the delays must increase");
    const C10 = matrix(c10, "plant.C10", undefined, n), C2 = matrix(c2, "plant.C2", undefined, n);
    const A = each(a, "plant.A", delays.length, (x, path) => matrix(x, path, n, n));
    const C1 = each(c1, "plant.C1", delays.length, (x, path) => matrix(x, path, rows(C10), n)), B = matrix(b, "plant.B", n);
    const words = `The plant: A₀ = ${inRows(A0)}, ${A.map((M, i) => `A = ${inRows(M)} with the delay ${decimal(delays[i])} s`).join(", ")}, B = ${inRows(B)}, C₁ = ${inRows(C10)}, C₂ = ${inRows(C2)}.`;
    if (!change) return { A0, A, B, C10, C1, C2, delays, n, words };
    const T = square(change, "witness.change", n), back = solved(T, identity(n), "witness.change has no inverse"), q = rows(C2);
    const moved = (M) => product(T, M, back), sensor = times(C2, back), free = indices(n - q);
    demand(q <= n && (!free.length || same(part(sensor, indices(q), free), zeros(q, n - q))), "C2 is not [0 c] after the change");
    solved(part(sensor, indices(q), indices(q).map((i) => n - q + i)), identity(q), "c in C2 = [0 c] has no inverse");
    return { A0: moved(A0), A: A.map(moved), B: times(T, B), C10: times(C10, back), C1: C1.map((M) => times(M, back)), C2: sensor, delays, n, words };
  }

  // Forms are polynomials in letters: e_i the error, l_j = f_j(-1) the late errors, w and v, the moments m_j,c of s^c f_j(s)
  // over [-1, 0], where f_j(s) = e(t + tau s); and the local letters n_i,j,c, the integral of s^c f_i f_j.
  const pair = (a, b) => (a < b ? `${a} ${b}` : `${b} ${a}`);
  const local = (i, j, c) => `n${Math.min(i, j)},${Math.max(i, j)},${c}`;
  const put = (form, key, c) => form.set(key, form.has(key) ? plus(form.get(key), c) : c);
  const FLAT = [[0, 1]], HUMP = [[1, -1], [2, -1]]; // the weights 1 and -s(s + 1), not negative on [-1, 0]
  const moment = (weight, k) => sum(weight.map(([a, c]) => number((k + a) % 2 ? -c : c, k + a + 1)));

  // Adds the integral of weight(s) Z(s)' M Z(s), Z = (points; s^a f; s^a m_b), which is never negative for M > 0.
  function addSquare(form, M, weight, points, count, degree, kernels) {
    const Z = [...points.map((letter) => ({ letter, s: 0 })),
      ...indices(degree + 1).flatMap((s) => indices(count).map((f) => ({ f, s }))),
      ...kernels.flatMap(([s, b]) => indices(count).map((f) => ({ letter: `m${f},${b}`, s })))];
    demand(rows(M) === Z.length, `a Gram matrix must have ${Z.length} rows, got ${rows(M)}`);
    positive(M, `the Gram matrix of ${Z.length} rows`);
    Z.forEach((x, i) => Z.slice(i).forEach((y, k) => {
      const c = times(number(k ? 2 : 1), entry(M, i, i + k)), s = x.s + y.s;
      const keyOf = (a) => (x.letter || y.letter ? pair(x.letter ?? y.letter, `m${x.f ?? y.f},${s + a}`) : local(x.f, y.f, s + a));
      if (x.letter && y.letter) put(form, pair(x.letter, y.letter), times(c, moment(weight, s)));
      else for (const [a, factor] of weight) put(form, keyOf(a), times(c, number(factor)));
    }));
  }
  function squaresOf(grams, points, count, degree, path) {
    const form = new Map();
    each(grams, path, 2, symmetric).forEach((M, k) => {
      const order = degree - k, most = indices(order + 1);
      const kernels = most.flatMap((a) => most.map((b) => [a, b]));
      addSquare(form, M, k ? HUMP : FLAT, points, count, order, kernels);
    });
    return form;
  }

  // V' + 2 v'z - g (|w|^2 + |v|^2) + N = 0 but for what an injection of the measured error can cancel: so V' < g (|w|^2 + |v|^2)
  // - 2 v'z, and with v = z/g the energy of z is below g^2 times that of w.
  function supplied(given, witness, degree, g) {
    demand(integer(degree, "degree", 1) <= 6, "the degree is too large");
    const [change, storage, dissipation] = fields(witness, "witness", ["change", "storage", "dissipation"]);
    const plant = delayed(given, change), { n, delays } = plant, count = n * delays.length, q = rows(plant.C2);
    const named = (letter, k) => indices(k).map((i) => letter + i), [w, v, e, l] = [named("w", columns(plant.B)), named("v", rows(plant.C10)), named("e", n), named("l", count)];
    const V = squaresOf(storage, e, count, degree, "witness.storage"), total = squaresOf(dissipation, [...w, ...v, ...e, ...l], count, degree, "witness.dissipation");
    const delay = (j) => Math.floor(j / n), rate = (j) => inverse(delays[delay(j)]), alternate = (c) => number(c % 2 ? -1 : 1);
    const line = (M, letters, i) => letters.map((letter, j) => [letter, entry(M, i, j)]);
    const late = (parts, i) => parts.flatMap((M, k) => line(M, l.slice(k * n, (k + 1) * n), i));
    function derivative(letter) {
      const [j, c] = letter.slice(1).split(",").map(Number);
      if (letter[0] === "e") return [...line(plant.A0, e, j), ...late(plant.A, j), ...line(negative(plant.B), w, j)];
      return [...(c ? [[`m${j},${c - 1}`, number(-c)]] : [[`e${j % n}`, number(1)]]), [`l${j}`, negative(alternate(c))]].map(([name, x]) => [name, times(x, rate(j))]);
    }
    for (const [key, c] of V) {
      const [a, b] = key.split(" "), [i, j, s] = key.slice(1).split(",").map(Number);
      for (const [moving, other] of b ? [[a, b], [b, a]] : []) for (const [letter, x] of derivative(moving)) put(total, pair(letter, other), times(c, x));
      if (b) continue;
      const x = times(c, rate(i));
      demand(delay(i) === delay(j) || same(c, number(0)), "V couples two delays at one point");
      put(total, s ? local(i, j, s - 1) : pair(`e${i % n}`, `e${j % n}`), s ? times(x, number(-s)) : x);
      put(total, pair(`l${i}`, `l${j}`), negative(times(x, alternate(s))));
    }
    for (const letter of [...w, ...v]) put(total, pair(letter, letter), negative(g));
    v.forEach((letter, i) => [...line(plant.C10, e, i), ...late(plant.C1, i)].forEach(([name, x]) => put(total, pair(letter, name), times(number(2), x))));
    const seen = (letter) => Number(letter.slice(1).split(",")[0]) % n >= n - q;
    for (const [key, c] of total) {
      if (same(c, number(0))) continue;
      const [a, b] = key[0] === "n" ? key.slice(1).split(",").slice(0, 2).map((i) => `m${i}`) : key.split(" "), kinds = a[0] + b[0];
      const joined = key[0] !== "n" || delay(Number(a.slice(1))) === delay(Number(b.slice(1)));
      const cancelled = ["ee", "em", "mm"].includes(kinds) ? joined && (seen(a) || seen(b)) : (kinds === "el" && seen(b)) || (kinds === "lm" && seen(a));
      demand(cancelled, `the balance of energy fails at ${key}`);
    }
    return [plant.words, "The Gram matrices of the storage and of the dissipation are positive definite.",
      `Their balance holds coefficient by coefficient, ${total.size} of them, but for what an injection of the measured error cancels: an observer reaches the level ${decimal(g, 7, true)}.`];
  }

  // e^{-i w tau} to 40 digits, by its series in whole numbers.
  function wave(angle) {
    const unit = BigInt(10) ** BigInt(60), x = (angle.a[0][0] * unit) / angle.d, parts = [unit, NONE, NONE, NONE];
    demand(size(x) <= BigInt(20) * unit, "the frequency is too high");
    for (let term = unit, k = 1; term !== NONE; k += 1) parts[k % 4] += (term = (term * x) / unit / BigInt(k));
    return [over([[parts[0] - parts[2]]], unit), over([[parts[1] - parts[3]]], unit)];
  }
  // x a(t), a(t) a slow envelope of cos wt, with C2 x = 0: the disturbance that moves the plant so shows nothing in y.
  function unseen(given, g, witness) {
    const plant = delayed(given), [f, s] = fields(witness, "witness", ["frequency", "state"]), omega = rational(f, "witness.frequency");
    const x = matrix(s, "witness.state", plant.n, 1), waves = plant.delays.map((tau) => wave(times(omega, tau)));
    demand(same(times(plant.C2, x), zeros(rows(plant.C2), 1)), "the state is seen by y");
    demand(columns(plant.B) === plant.n, "B has no inverse");
    const back = solved(plant.B, identity(plant.n), "B has no inverse"), small = same(omega, number(0)) ? number(0) : over([[ONE]], BigInt(10) ** BigInt(40));
    const lagged = (parts, k) => sum(parts.map((M, i) => times(times(M, x), waves[i][k])), zeros(rows(parts[0]), 1));
    const sizes = (M) => mapped(M, size), doubt = (parts) => scaled(sum(parts.map((M) => sizes(times(M, x))), zeros(rows(parts[0]), 1)), small);
    const drive = [plus(times(plant.A0, x), lagged(plant.A, 0)), plus(scaled(x, omega), lagged(plant.A, 1))].map((M) => sizes(times(back, M)));
    const output = [plus(times(plant.C10, x), lagged(plant.C1, 0)), lagged(plant.C1, 1)].map(sizes);
    const spent = sum(drive.map((M) => squares(plus(M, times(sizes(back), doubt(plant.A)))))), fuzzy = doubt(plant.C1);
    const made = sum(output.map((M) => squares(mapped(minus(M, fuzzy), (y) => (y < NONE ? NONE : y)))));
    demand(below(number(0), made), "the state does not move z");
    demand(!below(made, product(g, g, spent)), "the gain at this frequency is not proved to reach the level");
    return [plant.words, `At ${decimal(omega, 6)} rad/s a disturbance moves z and shows nothing in y. No observer can tell it from its opposite: none has a gain below ${decimal(g)}.`];
  }
  Object.assign(PROOFS, {
    "delay.gain-upper"(certificate) {
      const [degree] = fields(certificate.parameters, "parameters", ["degree"]), upper = more(fields(certificate.bound, "bound", ["upper"])[0], "upper");
      return { upper, steps: supplied(certificate.plant, certificate.witness, degree, upper) };
    },
    "delay.gain-lower"(certificate) {
      none(certificate, "parameters");
      const lower = more(fields(certificate.bound, "bound", ["lower"])[0], "lower");
      return { lower, steps: unseen(certificate.plant, lower, certificate.witness) };
    },
  });

  // ---------------------------------------------------------------- one certificate
  // Statements whose sentence names places of the paper stand for its own plants only.
  const OF_THE_PAPER = ["multirate.one-matrix", "multirate.shorter-periods", "dualrate.counterexample"];
  const NAMES = ["format", "paper", "name", "claims", "statement", "plant", "parameters", "bound", "witness"];

  // On which side of what was printed the proved bounds lie. `printed` stands for all numbers that round to it.
  function against(printed, lower, upper) {
    const found = /^([0-9]*)\.?([0-9]*)$/.exec(printed);
    if (!found || !(lower || upper)) return "";
    const places = BigInt(10) ** BigInt(found[2].length), half = number(1, BigInt(2) * places), p = number(found[1] + found[2], places);
    const [low, high] = [minus(p, half), plus(p, half)], ends = [low, high].map((c) => decimal(c, found[2].length + 1));
    if (upper && below(upper, low)) return `At most ${decimal(upper, 7, true)}, which is below ${ends[0]}, where the numbers that round to the printed ${printed} begin.`;
    if (lower && below(high, lower)) return `At least ${decimal(lower)}, which is above ${ends[1]}, where the numbers that round to the printed ${printed} end.`;
    const one = lower && upper ? null : lower ?? upper;
    if (one && !below(one, low) && !below(high, one)) return `${upper ? "At most" : "At least"} ${decimal(one, 7, Boolean(upper))}, which rounds to the printed ${printed}; from the other side it is bounded by another certificate.`;
    if (lower && upper && !below(lower, low) && !below(high, upper)) return `All between ${decimal(lower)} and ${decimal(upper, 7, true)} rounds to the printed ${printed}.`;
    return `The proved ${lower ? `${decimal(lower)}${upper ? " to " : " or more"}` : ""}${upper ? `${lower ? "" : "at most "}${decimal(upper, 7, true)}` : ""} does not decide whether ${printed} is right: it stands for ${ends.join(" to ")}.`;
  }

  // text: a certificate as its file has it. wanted: what it must be about. prints: printed numbers of the same quantity.
  function check(text, wanted = null, prints = []) {
    if (!exact) return { proved: false, steps: [], reason: "This browser has no BigInt, and cannot compute with exact fractions." };
    const steps = [];
    try {
      const certificate = parsed(text);
      const [format, paper, name, claims, statement, plant, , bound] = fields(certificate, "certificate", NAMES);
      demand(format === "replication-certificate/1", "the format is another one");
      for (const word of [name, plant?.name || "-"]) demand(typeof word === "string" && /^[A-Za-z0-9._-]{1,80}$/.test(word), "a name is no name");
      if (wanted) {
        for (const field of ["paper", "name", "claims", "statement", "plant", "parameters"]) {
          demand(ordered(certificate[field]) === ordered(wanted[field]), `${field} is not that of the paper's theorem`);
        }
        steps.push("The certificate is about the paper's plant, schedule and claim, and no other.");
      } else {
        demand(paper === null && Array.isArray(claims) && !claims.length, "a plant of one's own supports no claims of a paper");
        demand(!OF_THE_PAPER.includes(statement), "the sentence is about the paper");
      }
      demand(Object.hasOwn(PROOFS, statement), "this kind of theorem is not checked in the browser");
      const found = PROOFS[statement](certificate);
      demand(isObject(bound), "bound must be an object");
      for (const [side, value] of Object.entries(bound)) {
        demand(found[side] && same(found[side], rational(value, side)), `the ${side} bound is not the one that is proved`);
      }
      steps.push(...found.steps, ...prints.map((printed) => against(printed, found.lower, found.upper)).filter(Boolean));
      return { proved: true, holds: found.holds, steps, reason: "" };
    } catch (failure) {
      const told = failure instanceof SyntaxError ? "the certificate is no valid JSON" : `the check ended: ${failure.message}`;
      return { proved: false, steps, reason: failure instanceof Refused ? failure.message : told };
    }
  }
  globalThis.checkProof = check;
  globalThis.checkedStatements = Object.keys(PROOFS);

  // ---------------------------------------------------------------- in the page
  if (typeof document === "undefined") return;
  const made = (name, textContent, className = "") => Object.assign(document.createElement(name), { textContent, className });
  async function embedded() {
    const packed = document.querySelector("#certificates")?.textContent ?? "";
    const bytes = Uint8Array.from(atob(packed), (letter) => letter.charCodeAt(0));
    return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"))).json();
  }
  let waiting = null;
  async function tell(button) {
    const place = button.nextElementSibling?.matches(".checked") ? button.nextElementSibling : made("div", "", "checked");
    button.after(place);
    let outcome, spent = 0;
    try {
      const { entries, plants } = await (waiting ??= embedded()), { text, wanted, prints } = entries[button.dataset.check];
      const began = performance.now();
      outcome = check(text, { ...wanted, plant: plants[wanted.plant] }, prints);
      spent = performance.now() - began;
    } catch {
      outcome = { proved: false, steps: [], reason: "the certificate in this page is damaged or missing" };
    }
    const proved = `Proved here, in ${Math.max(1, Math.round(spent))} ms${outcome.holds === false ? ": the claim does not hold" : ""}`;
    const words = made("p", outcome.proved ? `${proved}.` : `Not proved: ${outcome.reason}.`, "word");
    words.setAttribute("role", "status");
    const steps = made("ol", ""), code = made("details", "");
    steps.append(...outcome.steps.map((step) => made("li", step)));
    code.append(made("summary", "The code of this check"));
    code.addEventListener("toggle", () => {
      if (code.open && code.children.length === 1) code.append(made("pre", document.querySelector("#check").textContent));
    });
    place.replaceChildren(words, steps, code);
    place.dataset.proved = outcome.proved;
  }
  document.addEventListener("click", ({ target }) => target.matches?.("button[data-check]") && tell(target));
})();
