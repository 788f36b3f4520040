// The page's computations, without the page. Numbers are in SI units; FACTS and KERNELS come from Python.

class Refused extends Error {}

function refuse(field, message) {
  throw Object.assign(new Refused(message), { field });
}

// --- numbers as text ---------------------------------------------------------------------------------------------

// Python's format(x, ".<digits>g").
function general(x, digits) {
  if (!Number.isFinite(x)) return x > 0 ? "inf" : "-inf";
  if (x === 0) return "0";
  const [mantissa, power] = x.toExponential(digits - 1).split("e");
  const exponent = Number(power);
  const short = (text) => (text.includes(".") ? text.replace(/\.?0+$/, "") : text);
  if (exponent >= -4 && exponent < digits) return short(x.toFixed(Math.max(digits - 1 - exponent, 0)));
  const sign = exponent < 0 ? "-" : "+";
  return `${short(mantissa)}e${sign}${String(Math.abs(exponent)).padStart(2, "0")}`;
}

// "2.5 mm" or "2.5" in SI units; a plain number is in the unit of the system, and % is a part of `whole`, if there is one.
// Dimensions are those of FACTS.dimensions, "", "beta" and "slowness". A decimal comma is a point, but not in "1,000".
function parseQuantity(field, label, text, dimension, system, whole) {
  const unit = unitOf(dimension, system);
  const typed = text.trim();
  if (/^[+-]?[1-9]\d{0,2},\d{3}(?![\d.,])/.test(typed))
    refuse(field, `${label} is "${typed}", which has two meanings: expected ${typed.replace(",", ".")} or ${typed.replace(",", "")}`);
  // A typographic minus, and 7*10^10 for 7e10.
  const plain = typed.replace(/\u2212/g, "-").replace(/(\d) ?[*\u00d7\u00b7x] ?10(?:\^|\*\*)([+-]?\d{1,3})/, "$1e$2");
  const match = /^([+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d{1,3})?)\s*([a-z\u00b5\u03bc(%].*)?$/i.exec(plain);
  if (!match) refuse(field, `${label} is "${typed}": expected ${unit ? `a number, in ${unit} unless it has a unit` : "a number"}`);
  const factor = match[2] === "%" && whole ? whole / 100 : factorOf(dimension, match[2] ?? unit);
  if (factor === undefined)
    refuse(field, `${label} has the unit "${match[2]}": expected ${dimension ? `a unit such as ${(FACTS.dimensions[dimension] ?? [unit]).join(" or ")}` : "none, or %"}`);
  return Number(match[1].replace(",", ".")) * factor;
}

function unitOf(dimension, system) {
  const units = FACTS.systems[system];
  const [length, time] = units.speed.split("/");
  if (dimension === "beta") return `(${time}/${length})^(1/5)`;
  if (dimension === "slowness") return `${time}/${length}`;
  return dimension ? units[dimension] : "";
}

// The size of a unit of a dimension in SI units, undefined for any other text.
function factorOf(dimension, unit) {
  if (!dimension) return { "": 1, "%": 0.01 }[unit];
  const isBeta = dimension === "beta";
  const base = isBeta ? /^\((.*)\) ?(?:\^|\*\*) ?\(1\/5\)$/.exec(unit)?.[1] : unit;
  const [size, ...powers] = productOfUnits(base ?? "");
  const [, ...wanted] = productOfUnits(FACTS.dimensions[dimension]?.[0] ?? "s/m");
  if (!powers.length || powers.some((power, i) => power !== wanted[i])) return undefined;
  return isBeta ? size ** 0.2 : size;
}

// The size in SI units of a product such as "kg m^-3" or "g/cm3", and its powers of length, mass and time; or [].
// It is what `viscopade.quantity` reads, for the units of FACTS.
function productOfUnits(text) {
  const plain = text.trim().replace(/[\u207b\u00b9\u00b2\u00b3\u00b5\u03bc]/g, (c) => ({ "\u207b": "-", "\u00b9": "1", "\u00b2": "2", "\u00b3": "3" })[c] ?? "u");
  const power = "[A-Za-z]+(?:(?:\\^|\\*\\*)?-?[1-9])?";
  if (!RegExp(`^${power}(?:(?: ?[*/\u00b7] ?| )${power})*$`).test(plain)) return [];
  let product = [1, 0, 0, 0];
  for (const [, slash, name, exponent] of plain.matchAll(/(\/?) ?([A-Za-z]+)(?:\^|\*\*)?(-?[1-9])?/g)) {
    if (!Object.hasOwn(FACTS.units, name)) return [];
    const [size, ...powers] = FACTS.units[name];
    const n = Number(exponent ?? 1) * (slash ? -1 : 1);
    product = [product[0] * size ** n, ...powers.map((each, i) => product[i + 1] + n * each)];
  }
  return [Number(product[0].toPrecision(15)), ...product.slice(1)]; // 1000 for g/cm^3, not 999.9999999999998
}

function inUnit(x, dimension, system) {
  return x / factorOf(dimension, unitOf(dimension, system));
}

// --- laws --------------------------------------------------------------------------------------------------------

// The value of an interpolant: Chebyshev polynomials on panels, constant before them, a straight line behind.
function interpolated(table, row, s) {
  const { ends } = table;
  const last = ends[ends.length - 1];
  const inside = Math.min(Math.max(s, ends[0]), last);
  let panel = 0;
  while (panel < ends.length - 2 && inside >= ends[panel + 1]) panel += 1;
  const [low, high] = [ends[panel], ends[panel + 1]];
  const z = (2 * inside - low - high) / (high - low);
  const c = table.coefficients[row][panel];
  let [one, two] = [0, 0];
  for (let k = c.length - 1; k > 0; k -= 1) [one, two] = [2 * z * one - two + c[k], one];
  const slope = table.slopes[row];
  return z * one - two + c[0] + (slope ? slope * Math.max(s - last, 0) : 0);
}

// ln((1 - eps)/eps) of a law's table at s = ln kappa.
function logOdds(table, s) {
  if (s === -Infinity) return s;
  const last = table.ends[table.ends.length - 1];
  const near = Math.min(s, last) + interpolated(table, 0, s);
  if (s <= last) return near;
  const logEpsilon = -(Math.max(near, 0) + Math.log1p(Math.exp(-Math.abs(near)))) - table.decay * (s - last);
  return Math.log(-Math.expm1(logEpsilon)) - logEpsilon;
}

const isPaper = (law, end) => law === FACTS.laws[0] && end === "force";
const isHertz = (law) => law.a === 1.5;
const lawOf = (name) => FACTS.laws.find((law) => law.name === name);
const tableOf = (law, end) => law.ends[end] || law.ends.force;

// eps and 1 - eps at kappa: the paper's law by the proven kernel, all others by their tables. Null beyond the table.
function restitutionOf(law, end, kappa, exact = !isPaper(law, end)) {
  if (!exact) return byKernel(FACTS.kernels[FACTS.kernels.length - 1].name, kappa);
  const table = tableOf(law, end);
  if (table.largest !== null && kappa > table.largest) return null;
  const odds = logOdds(table, Math.log(kappa));
  return { epsilon: 1 / (1 + Math.exp(odds)), loss: 1 / (1 + Math.exp(-odds)) };
}

// w = beta^5 speed is kappa^5 for speed 1.
function byKernel(name, kappa) {
  const [restitution, dissipation] = KERNELS[name];
  const epsilon = restitution(1, kappa);
  return { epsilon, loss: dissipation(1, kappa) / (1 + epsilon) };
}

// eps of an answer with more digits than the kernel has.
const byTable = (answer, input) => restitutionOf(answer.law, input.end, answer.kappa, true).epsilon;

// x_max and tau_c in the law's units, or null where the table ends.
function course(law, end, kappa) {
  const table = tableOf(law, end);
  if (table.largest_of_course !== null && kappa > table.largest_of_course) return null;
  const s = Math.log(kappa);
  const compression = Math.exp(interpolated(table, 1, s));
  return { compression, duration: compression * interpolated(table, 2, s) };
}

// The end of an interval towards the place from which on a test holds, after a number of halvings.
function bisected(low, high, holds, halvings) {
  for (let i = 0; i < halvings; i += 1) {
    const middle = (low + high) / 2;
    if (holds(middle)) high = middle;
    else low = middle;
  }
  return high;
}

// The kappa that gives eps, or null if the table has none: by bisection of the rising log-odds.
function kappaFrom(law, end, epsilon) {
  if (epsilon === 1) return 0;
  const table = tableOf(law, end);
  const wanted = Math.log1p(-epsilon) - Math.log(epsilon);
  const [low, high] = [-400, table.largest === null ? 400 : Math.log(table.largest)];
  if (logOdds(table, high) < wanted) return null;
  return Math.exp(bisected(low, high, (s) => logOdds(table, s) >= wanted, 80));
}

// --- weight ------------------------------------------------------------------------------------------------------

// The state after which a motion [s, v] is over, null if it turns back before or stays, undefined where its damping is too
// strong for the steps of a state: the classical Runge-Kutta method, and halving of the last step.
function motion(rates, state, over, stepOf, stays) {
  const step = ([s, v], h) => {
    const [s1, v1] = rates([s, v]);
    const [s2, v2] = rates([s + (h / 2) * s1, v + (h / 2) * v1]);
    const [s3, v3] = rates([s + (h / 2) * s2, v + (h / 2) * v2]);
    const [s4, v4] = rates([s + h * s3, v + h * v3]);
    return [s + (h / 6) * (s1 + 2 * s2 + 2 * s3 + s4), v + (h / 6) * (v1 + 2 * v2 + 2 * v3 + v4)];
  };
  for (let i = 0; i < MOST_STEPS; i += 1) {
    const h = stepOf(state);
    const next = step(state, h);
    if (!Number.isFinite(next[1]) || next[0] > 1e4) return undefined;
    if (over(next)) return step(state, bisected(0, h, (part) => over(step(state, part)), 40));
    if ((state[1] < 0 && next[1] >= 0) || stays(next)) return null;
    state = next;
  }
  return undefined;
}

// eps of the scaled contact with a load G, 0 if the body stays down, in the variables of `viscopade.collision.contact`:
// x = s^4 and dt = 4 s^3 dsigma. Null where the damping is too strong.
function withLoad(law, end, kappa, G) {
  const force = (s, v) => s ** (4 * law.a) + kappa * s ** (4 * law.b) * v;
  const rates = ([s, v]) => [v, 4 * s ** 3 * (G - force(s, v))];
  const over = ([s, v]) => v < 0 && (s <= 0 || (end === "force" && force(s, v) <= 0));
  const last = motion(rates, [0, 1], over, () => FALL_STEP, ([, v]) => Math.abs(v) < 1e-12); // it creeps to its rest
  if (!last) return last === null ? 0 : null;
  const [s, v] = last;
  return Math.sqrt(Math.max(v * v - 2 * G * Math.max(s, 0) ** 4, 0)); // it rises to x = 0 against its weight
}

const FALL_STEP = 1 / 256;
const MOST_STEPS = 1e5;

// The speed below which eps is 0, or null; the search begins at a speed and has as many steps of a factor of 4.
function stickingSpeed(epsilonAt, speed, steps) {
  let [low, high] = [speed, speed];
  for (let i = 0; i < steps && epsilonAt(low) > 0; i += 1) [low, high] = [low / 4, low];
  for (let i = 0; i < steps && !(epsilonAt(high) > 0); i += 1) [low, high] = [high, high * 4];
  if (epsilonAt(low) !== 0 || !(epsilonAt(high) > 0)) return null;
  return Math.exp(bisected(Math.log(low), Math.log(high), (s) => epsilonAt(Math.exp(s)) > 0, 14));
}

// What weight does to a body that falls on a wall: g t_c/v, eps, and the speed below which it stays down (null: none).
function fallOf(law, end, kappa, gravity, time, speed) {
  const at = (v) => {
    const ratio = v / speed;
    return [kappa * ratio ** law.power, ((gravity * time) / speed) * ratio ** ((-2 * law.a) / (law.a + 1))];
  };
  const epsilonAt = (v) => withLoad(law, end, ...at(v));
  const found = { share: (gravity * time * law.contactTime) / speed, epsilon: epsilonAt(speed), sticking: null, epsilonAt };
  if (!kappa || !gravity || found.epsilon === null) return found;
  return { ...found, sticking: stickingSpeed(epsilonAt, speed, 40) };
}

// The kappa with which a body that falls rebounds with eps, its weight included; null if there is none. G is a function
// of kappa.
function kappaOfDrop(law, end, epsilon, G) {
  const [low, high] = [1e-9, 1e3].map(Math.log);
  // Where the damping is too strong for the steps (null), eps is certainly smaller.
  const isAbove = (s) => (withLoad(law, end, Math.exp(s), G(Math.exp(s))) ?? 0) > epsilon;
  if (!isAbove(low) || isAbove(high)) return null;
  return Math.exp(bisected(low, high, (s) => !isAbove(s), 50));
}

// --- adhesion ----------------------------------------------------------------------------------------------------

// eps of viscoelastic spheres that adhere (JKR, `viscopade.collision.adhesion`) as a function of the speed. With the
// contact radius a_0 z^2 all is a polynomial in z: x = z^4 - z, F = z^6 - 3/2 z^3 + kappa z^2 v, dt = (4 z^3 - 1) dtau.
// The neck breaks at 4 z^3 = 1. 0 if the bodies stay together, null where the damping is too strong.
function adhesive(pair, A, work, gravity) {
  const first = Math.cbrt((2 * Math.PI * work * pair.radius ** 2) / pair.modulus); // a_0
  const [length, force] = [first ** 2 / pair.radius, (4 / 3) * (pair.modulus / pair.radius) * first ** 3];
  const unit = Math.sqrt((length * force) / pair.mass); // of speed
  const kappa = (2 * A * pair.modulus * first * unit) / force;
  const load = (pair.mass * gravity) / force;
  const rates = ([z, v]) => [v, (load - (z ** 6 - 1.5 * z ** 3 + kappa * z * z * v)) * (4 * z ** 3 - 1)];
  const over = ([z, v]) => v < 0 && 4 * z ** 3 <= 1;
  const elastic = (z) => 0.4 * z ** 10 - z ** 7 + 0.375 * z ** 4 - load * (z ** 4 - z); // energy; too little is left to part
  return (speed) => {
    const impact = speed / unit;
    // A step is a small part of the times in which z changes, the spring swings and the damping slows the bodies down.
    const stepOf = ([z, v]) => 1 / (72 * (Math.abs(v) / z + z ** 4 + kappa * z ** 5));
    const last = motion(rates, [1, impact], over, stepOf, ([z, v]) => v * v + 2 * (elastic(z) - elastic(Math.cbrt(1 / 4))) < 0);
    if (!last) return last === null ? 0 : null;
    const [z, v] = last;
    return Math.sqrt(Math.max(v * v - 2 * load * (z ** 4 - z), 0)) / impact;
  };
}

// eps of a Padé approximant of the paper's law at v*.
function approximant(pade, vStar) {
  const sum = (terms) => terms.reduceRight((total, c) => total * vStar + c, 0);
  return sum(pade.a) / sum(pade.b);
}

// --- bodies ------------------------------------------------------------------------------------------------------

const reduced = (a, b) => (Math.min(a, b) === Infinity ? Infinity : Math.min(a, b) / (1 + Math.min(a, b) / Math.max(a, b)));
const planeStrain = (body) => body.young / ((1 - body.poisson) * (1 + body.poisson));
const massOf = (body) => (body.radius === Infinity ? Infinity : (4 / 3) * Math.PI * body.radius ** 3 * body.density);

// What `viscopade.Pair` knows of two bodies; a wall has an infinite radius.
function pairOf(first, second) {
  const mass = reduced(massOf(first), massOf(second));
  const radius = reduced(first.radius, second.radius);
  const modulus = reduced(planeStrain(first), planeStrain(second));
  const stiffness = (((4 / 3) * modulus * Math.sqrt(radius)) ** 0.4) / mass ** 0.4;
  // The first one's share of the compression: its compliance over the sum of both.
  const share = 1 / (1 + planeStrain(first) / planeStrain(second));
  return { first, second, mass, radius, modulus, stiffness, share };
}

// --- the answer --------------------------------------------------------------------------------------------------

// kappa at the impact speed, from the damping as it is given.
function kappaOf(input, law, pair) {
  const { by, damping, speed, at, height } = input;
  const paper = law === FACTS.laws[0];
  if (by === "epsilon") {
    const found = kappaFrom(law, input.end, damping);
    if (found === null) refuse("damping", `eps is ${general(damping, 6)}: expected 0.001 to 1 for this end of contact`);
    return found * (speed / at) ** law.power;
  }
  if (by === "drop") {
    const epsilon = Math.sqrt(damping / height);
    const found = kappaOfDrop(law, input.end, epsilon, (kappa) => (input.gravity * timeUnit(input, law, pair, kappa)) / speed);
    if (found === null) refuse("damping", `eps = sqrt(${general(damping / height, 6)}) = ${general(epsilon, 6)}: expected a rebound that a ball with this contact can have`);
    return found;
  }
  if (by === "kappa") return paper ? damping * damping : damping;
  if (by === "own") return law.factor * damping * speed ** law.power;
  const beta = by === "beta" ? damping : 1.5 * pair.stiffness * meanOfA(pair, damping, input.second);
  return beta * speed ** law.power;
}

function meanOfA(pair, first, second) {
  return second === undefined || second === null ? first : first + (1 - pair.share) * (second - first);
}

// The unit of time of the scaled equation: from the bodies, or from the contact time at this speed; undefined without.
function timeUnit({ speed, end, contactTime }, law, pair, kappa) {
  if (pair && isHertz(law)) return speed ** -0.2 / pair.stiffness;
  return contactTime ? contactTime / course(law, end, kappa)?.duration : undefined;
}

// All that the page says of a collision. `input` has law, end, speed, by, damping (of a drop the height of the rebound),
// at, height (of a drop; the speed is that of the impact), second (the A of the other body, or null), bodies (null, or
// [first, second]), contactTime (at the speed, where the bodies do not give it, or null), strength (or null), gravity (of
// a body that falls on a wall, or null), adhesion (the work of adhesion, or null), and system for the sentences.
function calculate(input) {
  const law = lawOf(input.law);
  const pair = input.bodies && pairOf(...input.bodies);
  const kappa = kappaOf(input, law, pair);
  if (!(kappa <= 1e40)) refuse("damping", "the damping is too strong: expected kappa up to 1e40");
  const found = restitutionOf(law, input.end, kappa);
  if (found === null) {
    const largest = general(tableOf(law, input.end).largest, 4);
    refuse("damping", `kappa is ${general(kappa, 4)}: expected up to ${largest} for this end of contact, where eps is 0.001`);
  }
  const scaled = course(law, input.end, kappa);
  const answer = { law, kappa, ...found, vStar: Math.sqrt(kappa), scaled, pair, rebound: found.epsilon * input.speed };
  if (law === FACTS.laws[0]) {
    answer.beta = kappa * input.speed ** -0.2;
    if (pair) answer.A = answer.beta / pair.stiffness / 1.5;
  } else if (law.symbol) {
    answer.own = kappa / law.factor / input.speed ** law.power;
  }
  const time = timeUnit(input, law, pair, kappa);
  if (time && scaled) {
    answer.compression = scaled.compression * input.speed * time;
    answer.contactTime = scaled.duration * time;
    if (pair) answer.overlap = answer.compression / Math.min(pair.first.radius, pair.second.radius);
  }
  if (time && (!pair || isWall(pair)) && input.gravity > 0) {
    answer.fall = fallOf(law, input.end, kappa, input.gravity, time, input.speed);
  }
  if (pair && isPaper(law, input.end) && input.adhesion > 0) {
    const gravity = pair.second.radius === Infinity ? input.gravity || 0 : 0;
    const epsilonAt = adhesive(pair, answer.A, input.adhesion, gravity);
    answer.adhesion = { epsilonAt, epsilon: epsilonAt(input.speed), sticking: stickingSpeed(epsilonAt, input.speed, 8) };
  }
  answer.warnings = warningsOf(answer, input);
  return answer;
}

// The sentences of `viscopade.collision.limits`.
function warningsOf(answer, input) {
  const { pair, overlap, contactTime } = answer;
  const limit = FACTS.limits;
  const found = [];
  if (overlap === undefined) return found;
  const speedText = (v) => `${general(inUnit(v, "speed", input.system), 3)} ${unitOf("speed", input.system)}`;
  const say = (name, values) =>
    found.push(FACTS.sentences[name].replace(/\{(\w+)\}/g, (_, key) => values[key]));
  const speed = speedText(input.speed);
  if (overlap > limit.depth) say("depth", { share: general(overlap, 2), limit: limit.depth });
  if (input.strength) {
    const pressure = (limit.yieldPressure * input.strength * Math.PI) / (2 * pair.modulus);
    const depth = pair.radius * pressure ** 2;
    const yields = Math.sqrt(((16 / 15) * pair.modulus * Math.sqrt(pair.radius) * depth ** 2.5) / pair.mass);
    if (input.speed > limit.nearYield * yields)
      say("yield", { speed, beyond: input.speed > yields ? "beyond" : "near", limit: speedText(yields) });
  }
  const crossings = [pair.first, pair.second].filter((body) => body.radius !== Infinity);
  const crossing = Math.min(...crossings.map((body) => (2 * body.radius) / Math.sqrt(body.young / body.density)));
  if (contactTime < limit.slowness * crossing)
    say("slowness", { speed, share: general(contactTime / crossing, 2), limit: limit.slowness });
  if (answer.A !== undefined && answer.A / contactTime > limit.relaxation)
    say("relaxation", { speed, share: general(answer.A / contactTime, 2), limit: limit.relaxation });
  return found;
}

// --- curves ------------------------------------------------------------------------------------------------------

function range(low, high, number, isLog) {
  return Array.from({ length: number }, (_, i) => {
    const part = i / (number - 1);
    return isLog ? low * (high / low) ** part : low + (high - low) * part;
  });
}

// eps of a curve at speeds, NaN where there is none. Kinds: "law" (with the eps of the answer at its speed),
// "reference" (the chosen law by its table), "kernel" and "pade" (of the paper's law).
function curveAt(curve, answer, input, speeds) {
  const kappaAt = (law, kappa) => (v) => kappa * (v / input.speed) ** law.power;
  if (curve.kind === "adhesion") return speeds.map((v) => answer.adhesion.epsilonAt(v) ?? NaN);
  if (curve.kind === "law") {
    const law = lawOf(curve.name);
    const kappa = law === answer.law ? answer.kappa : kappaFrom(law, input.end, byTable(answer, input));
    if (kappa === null) return speeds.map(() => NaN);
    return speeds.map(kappaAt(law, kappa)).map((k) => restitutionOf(law, input.end, k, true)?.epsilon ?? NaN);
  }
  const kappas = speeds.map(kappaAt(answer.law, answer.kappa));
  if (curve.kind === "reference") return kappas.map((k) => restitutionOf(answer.law, input.end, k, true)?.epsilon ?? NaN);
  if (curve.kind === "kernel") return kappas.map((k) => byKernel(curve.name, k).epsilon);
  const pade = FACTS.pade.find(({ name }) => name === curve.name);
  return kappas.map((k) => approximant(pade, Math.sqrt(k)));
}

// --- text to copy ------------------------------------------------------------------------------------------------

const filled = (text, mark, values) => text.replace(mark, (_, name) => values[name]);

// The command that prints proven digits of the same collision.
function commandOf(answer, input) {
  if (isPaper(answer.law, input.end))
    return `viscopade epsilon --beta ${general(answer.beta, 12)} --speed ${general(input.speed, 15)}`;
  const end = input.end === "force" ? "" : " --end return";
  return `viscopade epsilon --law ${answer.law.name}${end} --kappa ${general(answer.kappa, 12)}`;
}

// The line for a simulator, if the page can make it, and the command that makes all of it, if there is one.
function linesOf(name, answer, input) {
  const program = FACTS.programs.find((each) => each.name === name);
  const command = simulatorCommand(program, answer, input);
  if (!program.walls && answer.pair && isWall(answer.pair)) return { command: null, reason: `${program.title} has no walls: two spheres are needed.` };
  if (answer.epsilon === 1 && program.law) return { ...command, reason: "Without damping there is no parameter to write." };
  const warning = stepWarning(program, answer);
  const step = program.step && !warning ? `${program.title}'s default time step is ${timeText(program.step)}.` : "";
  return { ...command, warning, step, ...(program.law ? softLine(program, answer, input) : hardLine(program, answer, input)) };
}

// A warning if the time step that a program has unless the user gives one is no small part of the contact, or "".
function stepWarning(program, answer) {
  const { chosen, fewest, fine } = FACTS.steps;
  const steps = answer.contactTime / program.step;
  if (!(steps < fine)) return "";
  const step = timeText(program.step);
  const whose = `Warning: with ${program.title}'s default step of ${step} a contact lasts ${general(steps, 2)} steps`;
  if (!program.law) return `${whose}: write a step of ${timeText(Number(general(answer.contactTime / fine, 2)))}.`;
  if (steps < fewest) return `${whose}; --contact-time "${timeText(chosen * program.step)}" makes a contact that it resolves.`;
  return `${whose}, and the line is not exact: the command adapts the damping (--time-step).`;
}

// A time in s with a prefix, as the command line takes it.
function timeText(time) {
  const [name, unit] = [["s", 1], ["ms", 1e-3], ["us", 1e-6]].find(([, size]) => time >= size) ?? ["ns", 1e-9];
  return `${general(time / unit, 6)} ${name}`;
}

const isWall = (pair) => pair.second.radius === Infinity;
const isAlike = ({ first, second }) =>
  first.young === second.young && first.poisson === second.poisson && (second.radius === Infinity || first.density === second.density);

// With a law of its own, a program has its own loss by weight and by time steps: the command has both.
function simulatorCommand(program, answer, input) {
  const { pair } = answer;
  const steps = answer.contactTime / program.step;
  const gravity = program.law && answer.fall ? ` --gravity ${general(input.gravity, 15)}` : "";
  const isAdapted = program.law && steps >= FACTS.steps.fewest && steps < FACTS.steps.fine;
  const further = gravity + (isAdapted ? ` --time-step ${program.step}` : "");
  const paper = isPaper(answer.law, input.end);
  const words = [`viscopade simulators ${program.name}`];
  const number = (x, digits = 12) => general(x, digits);
  if (pair && paper && isAlike(pair) && (input.second === null || input.second === undefined)) {
    const byEpsilon = input.by === "epsilon" && input.at === input.speed;
    words.push(byEpsilon ? `--epsilon ${number(input.damping, 15)}` : `--dissipative-constant ${number(answer.A)}`);
    words.push(`--speed ${number(input.speed, 15)} --radius ${number(pair.first.radius, 15)}`);
    if (isWall(pair)) words.push("--wall");
    else if (pair.second.radius !== pair.first.radius) words.push(`--radius ${number(pair.second.radius, 15)}`);
    words.push(`--density ${number(pair.first.density, 15)} --young-modulus ${number(pair.first.young, 15)}`);
    words.push(`--poisson-ratio ${number(pair.first.poisson, 15)}`);
    if (input.strength) words.push(`--yield-strength ${number(input.strength, 15)}`);
    return { command: words.join(" ") + further };
  }
  if (!program.law) return { command: null, scene: Boolean(pair && paper) };
  const epsilon = input.by === "drop" ? Math.sqrt(input.damping / input.height) : answer.epsilon;
  words.push(`--epsilon ${number(epsilon, 7)} --speed ${number(input.speed, 15)}`);
  if (answer.contactTime !== undefined) words.push(`--contact-time ${number(answer.contactTime, 9)}`);
  else if (program.name === "mujoco") words.push("--contact-time TIME");
  return { command: words.join(" ") + further };
}

function hardLine(program, answer, input) {
  const { pair } = answer;
  if (!isPaper(answer.law, input.end))
    return { reason: "This is for viscoelastic spheres whose contact ends where the force vanishes." };
  if (!pair) return { reason: "This needs the bodies." };
  const text = program.texts[isWall(pair) ? "wall" : "pair"];
  if (!text) return { reason: "The page has no line for this; the command writes it." };
  if (program.name !== "lammps" && !isAlike(pair))
    return { reason: "For two materials use a scene: viscopade scene, viscopade simulators." };
  const { first, second } = pair;
  const nu = first.poisson === second.poisson
    ? first.poisson
    : 1 - 1 / (pair.share / (1 - first.poisson) + (1 - pair.share) / (1 - second.poisson));
  const numbers = {
    ...first,
    E: 2 * (1 - nu) * (1 + nu) * pair.modulus,
    eta_n0: 2 * answer.A * (pair.modulus / pair.mass),
    nu,
    E_eff: pair.modulus,
    A: answer.A,
    speed: input.speed,
    en: approximant({ a: FACTS.printedPade[0], b: FACTS.printedPade[1] }, answer.vStar),
  };
  return { line: withNumbers(text, numbers) };
}

const withNumbers = (text, numbers) => filled(text, /\{(\w+)\}/g, mapped(numbers, (x) => general(x, 9)));
const mapped = (of, change) => Object.fromEntries(Object.entries(of).map(([key, value]) => [key, change(value)]));

// The parameter that gives a program's own contact this eps at this speed.
function softLine(program, answer, input) {
  const law = FACTS.laws.find(({ elastic, damping }) => elastic === program.law.elastic && damping === program.law.damping);
  const kappa = kappaFrom(law, program.law.end, byTable(answer, input));
  const numbers = { speed: input.speed, parameter: kappa / program.kappa.factor };
  if (program.kappa.restitution) {
    const ratio = numbers.parameter;
    if (!(ratio < 1)) return { reason: "No coefficient in the program's range gives such a small eps." };
    numbers.parameter = Math.exp((-Math.PI * ratio) / Math.sqrt((1 - ratio) * (1 + ratio)));
  }
  if (program.kappa.per === "speed") numbers.parameter /= input.speed;
  if (program.kappa.per === "root of stiffness") {
    if (answer.contactTime === undefined) return { reason: "Give the contact time, or bodies and a law with Hertz's force." };
    const root = course(law, program.law.end, kappa).duration / answer.contactTime;
    numbers.stiffness = root * root;
    numbers.parameter *= root;
  }
  return { line: withNumbers(program.texts.any, numbers) };
}
