// The page: reads the fields, shows the answer, draws the curves, and stores its state in the address.

const $ = (id) => document.getElementById(id);
const STATE = [
  ...["law", "end", "system", "speed", "by", "damping", "at", "height", "other", "contact", "bodies", "radius", "density", "young", "poisson"],
  ...["strength", "kind", "radius2", "density2", "young2", "poisson2", "second", "gravity", "adhesion", "from", "to", "logarithmic", "vertical", "program"],
];
const FIELDS = {
  speed: ["impact speed", "speed"],
  at: ["the speed of eps", "speed"],
  height: ["the drop height", "length"],
  other: ["the other height", "length"],
  contact: ["the contact time", "time"],
  radius: ["radius", "length"],
  density: ["density", "density"],
  young: ["Young modulus", "pressure"],
  poisson: ["Poisson ratio", ""],
  strength: ["yield strength", "pressure"],
  radius2: ["the other radius", "length"],
  density2: ["the other density", "density"],
  young2: ["the other Young modulus", "pressure"],
  poisson2: ["the other Poisson ratio", ""],
  second: ["the other A", "time"],
  gravity: ["gravity", "acceleration"],
  adhesion: ["the work of adhesion", "energy per area"],
  from: ["the slowest speed", "speed"],
  to: ["the fastest speed", "speed"],
};
// Least and largest usual values of solid bodies in SI units, to notice a unit that was forgotten: choices, from dust to
// a boulder, from a balloon to beyond osmium (22,590 kg/m^3), and from soft gels to beyond diamond (1.2e12 Pa).
const USUAL = { radius: [1e-7, 0.5], density: [5, 25000], young: [1e3, 2e12] };
const MARK = "\u25b8";
let answer = null;
let input = null;
let system = null;
let saving = null;

// --- fields ------------------------------------------------------------------------------------------------------

const svgOf = (name, attributes, text) => {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text !== undefined) made.textContent = text;
  return made;
};
const element = (name, text, attributes = {}) => Object.assign(document.createElement(name), attributes, { textContent: text });
const choose = (select, options) => select.replaceChildren(...options.map(([value, text]) => new Option(text, value)));
const valueOf = (id) => ($(id).type === "checkbox" ? ($(id).checked ? "yes" : "no") : $(id).value);
const setValue = (id, value) => {
  if ($(id).type === "checkbox") $(id).checked = value === "yes";
  else $(id).value = value;
};

// The ways to give the damping of a law: label, dimension, and the slider's ends in SI units.
function ways(law) {
  const paper = law === FACTS.laws[0];
  const found = { epsilon: ["eps at a speed", "eps", "", 0.02, 0.999] };
  found.drop = ["a drop and its rebound", "Height of the rebound", "length", 0.02, 0.999]; // the slider is for eps
  if (paper) {
    found.A = ["A, a property of the material", "A", "time", 1e-10, 0.1];
    found.beta = ["beta = 3/2 A (rho/m_eff)^(2/5)", "beta", "beta", 1e-3, 10];
  } else if (law.symbol) {
    found.own = [`${law.symbol}, the law's own constant`, law.symbol, law.power ? "slowness" : "", 1e-3, 10];
  }
  found.kappa = paper
    ? ["v* at the impact speed", "v*", "", 1e-2, 10]
    : ["kappa at the impact speed", "kappa", "", 1e-3, law.ends[$("end").value]?.largest ?? 10];
  return found;
}

const programNow = () => FACTS.programs.find(({ name }) => name === $("program").value);
const wayNow = () => ways(lawOf($("law").value))[$("by").value];
const dimensionOf = (id) => (id === "damping" ? wayNow()[2] : FIELDS[id][1]);
const shownUnit = (dimension) => (dimension ? ` (${unitOf(dimension, $("system").value)})` : "");

function number(id, accepted, test, whole) {
  const label = id === "damping" ? wayNow()[1] : FIELDS[id][0];
  const x = parseQuantity(id, label, $(id).value, dimensionOf(id), $("system").value, whole);
  if (!test(x)) refuse(id, `${label} is ${$(id).value.trim()}: expected ${accepted}`);
  return x;
}

const positive = (id) => number(id, "a number > 0, from 1e-30 to 1e30 in SI units", (x) => x >= 1e-30 && x <= 1e30);
const ratio = (id) => number(id, "a number > -1 and <= 0.5", (x) => x > -1 && x <= 0.5);
const body = (end) => ({ radius: positive(`radius${end}`), density: positive(`density${end}`), young: positive(`young${end}`), poisson: ratio(`poisson${end}`) });

function bodies() {
  if (!$("bodies").checked || !isHertz(lawOf($("law").value))) return null;
  const first = body("");
  const kind = $("kind").value;
  if (kind === "same") return [first, first];
  if (kind === "size") return [first, { ...first, radius: positive("radius2") }];
  if (kind === "wall") return [first, { ...first, radius: Infinity, density: NaN }];
  if (kind === "sphere") return [first, body("2")];
  return [first, { radius: Infinity, density: NaN, young: positive("young2"), poisson: ratio("poisson2") }];
}

// A whole set of inputs, or an error that names a field.
function read() {
  const by = $("by").value;
  const found = { law: $("law").value, end: $("end").value, by, system: $("system").value };
  if (by !== "drop") found.speed = positive("speed");
  // Two digits before the point are percent.
  const percent = /^\d\d([.,]\d*)?$/.test($("damping").value.trim()) ? `, such as ${$("damping").value.trim()} %` : "";
  if (by === "epsilon") found.damping = number("damping", `a number > 0 and <= 1, from 1e-9 on${percent}`, (x) => x >= 1e-9 && x <= 1);
  else if (by !== "drop") found.damping = number("damping", "a number >= 0, up to 1e20 in SI units", (x) => x >= 0 && x <= 1e20);
  found.at = by === "epsilon" ? positive("at") : null;
  found.bodies = bodies();
  if (by === "A" && !found.bodies) refuse("bodies", "A needs the bodies: expected A with bodies, or beta, v*, or eps at a speed");
  const filledIn = (id) => $(id).value.trim() !== "";
  found.strength = found.bodies && filledIn("strength") ? positive("strength") : null;
  const other = by === "A" && ["sphere", "otherwall"].includes($("kind").value);
  found.contactTime = !found.bodies && filledIn("contact") ? positive("contact") : null;
  const falls = !found.bodies || ["wall", "otherwall"].includes($("kind").value);
  found.gravity = falls && filledIn("gravity") ? number("gravity", "a number >= 0", (x) => x >= 0 && x <= 1e20) : null;
  if (by === "drop") {
    if (!(found.gravity > 0)) refuse("gravity", "a drop needs a wall and gravity: expected a ball on a wall, with gravity > 0");
    if (!found.bodies && !found.contactTime) refuse("contact", "a drop needs a contact time, as the weight acts during the contact: expected a time > 0");
    found.height = positive("height");
    found.damping = number("damping", `a height > 0 and below ${$("height").value.trim()}, from which the ball falls`, (x) => x >= 1e-18 * found.height && x < found.height, found.height);
    found.other = filledIn("other") ? positive("other") : null;
    found.speed = Math.sqrt(2 * found.gravity * found.height);
    $("speed").value = general(inUnit(found.speed, "speed", found.system), DIGITS);
  }
  found.adhesion = by !== "drop" && found.bodies && isPaper(lawOf(found.law), found.end) && filledIn("adhesion") ? number("adhesion", "a number >= 0", (x) => x >= 0 && x <= 1e20) : null;
  found.second = other && filledIn("second") ? number("second", "a number >= 0", (x) => x >= 0 && x <= 1e20) : null;
  return found;
}

// --- sliders -----------------------------------------------------------------------------------------------------

const logit = (p) => Math.log(p / (1 - p));
function scaleOf(id) {
  const [by, [low, high]] = [$("by").value, id === "speed" ? ends() : wayNow().slice(3)];
  if (id === "speed" || !["epsilon", "drop"].includes(by))
    return { to: (x) => Math.log(x / low) / Math.log(high / low), from: (p) => low * (high / low) ** p };
  const [span, epsilonAt] = [logit(high) - logit(low), (p) => 1 / (1 + Math.exp(-(logit(low) + p * span)))];
  const placeOf = (epsilon) => (logit(epsilon) - logit(low)) / span;
  if (by === "epsilon") return { to: placeOf, from: epsilonAt };
  const height = positive("height");
  return { to: (x) => placeOf(Math.sqrt(x / height)), from: (p) => height * epsilonAt(p) ** 2 };
}

function slide(id) {
  const x = scaleOf(id).from($(`slide-${id}`).value / 1000);
  $(id).value = general(inUnit(x, dimensionOf(id), $("system").value), 4);
}

function placeSlider(id, x) {
  const slider = $(`slide-${id}`);
  const place = scaleOf(id).to(x);
  if (document.activeElement !== slider) slider.value = Math.round(1000 * Math.min(Math.max(Number.isNaN(place) ? 0 : place, 0), 1));
  slider.setAttribute("aria-valuetext", `${$(id).value} ${unitOf(dimensionOf(id), $("system").value)}`.trim());
}

// --- answers -----------------------------------------------------------------------------------------------------

const DIGITS = 7;
const quantityText = (x, dimension, digits = DIGITS) => `${general(inUnit(x, dimension, input.system), digits)} ${unitOf(dimension, input.system)}`.trim();
const epsilonText = (epsilon, zero, digits = 6) => (epsilon === null ? "out of range of this page" : epsilon ? general(epsilon, digits) : `0: ${zero}`);

// The rows of the first table, and those of the folded one.
function rows() {
  const { law, scaled, fall } = answer;
  const [paper, program, without] = [law === FACTS.laws[0], programNow(), fall ? ", without weight" : ""];
  const more = [["1 - eps", general(answer.loss, DIGITS), answer.loss]];
  const found = [
    [input.by === "drop" ? "eps, without weight" : "eps", general(answer.epsilon, DIGITS), answer.epsilon],
    [`Speed after the collision${without}`, quantityText(answer.rebound, "speed")],
  ];
  if (answer.contactTime !== undefined) {
    found.push([`Contact time${without}`, quantityText(answer.contactTime, "time", 4), answer.contactTime]);
    found.push([`Largest overlap${without}`, quantityText(answer.compression, "length", 4) + (answer.overlap === undefined ? "" : `, ${general(100 * answer.overlap, 4)} % of the radius`), answer.compression]);
  } else if (scaled) {
    const power = (x) => general(x, 4);
    const k = "(k/m)";
    const scale = -1 / (law.a + 1);
    const time = (1 - law.a) / (law.a + 1);
    const v = (p) => (p === 0 ? "" : p === 1 ? " v" : ` v^${power(p)}`);
    found.push(["Contact time", `${general(scaled.duration, DIGITS)} ${k}^${power(scale)}${v(time)}`]);
    found.push(["Largest overlap", `${general(scaled.compression, DIGITS)} ${k}^${power(scale)}${v(2 / (law.a + 1))}`]);
  } else {
    found.push(["Contact time", "out of range of this page: use viscopade epsilon"]);
  }
  if (fall) {
    more.push(["g t_c / v", general(fall.share, 3), fall.share]);
  }
  // A program with its own law also has its own eps with weight.
  if (fall && program.law) {
    found.push(["eps with weight, if it falls", `in the file for ${program.title}, by the command below`]);
  } else if (fall) {
    found.push(["eps with weight, if it falls", epsilonText(fall.epsilon, "it stays down"), fall.epsilon]);
    if (input.other) {
      const again = fall.epsilonAt(Math.sqrt(2 * input.gravity * input.other));
      const height = again ? `${general(100 * again ** 2 * input.other, 3)} cm (${general(100 * again ** 2, 3)} %), eps = ` : "";
      found.push([`From ${quantityText(input.other, "length")} it rebounds to`, height + epsilonText(again, "it stays down", 4), again]);
    }
    if (fall.sticking !== null) found.push(["Stays down below", quantityText(fall.sticking, "speed", 3), fall.sticking]);
  }
  const { adhesion } = answer;
  if (adhesion) {
    const name = `eps with adhesion${input.gravity > 0 ? " and weight" : ""}`;
    found.push([name, epsilonText(adhesion.epsilon, "they stick"), adhesion.epsilon]);
    if (adhesion.sticking !== null) found.push(["Sticks below", quantityText(adhesion.sticking, "speed", 3), adhesion.sticking]);
  }
  if (paper) more.push(["v*", general(answer.vStar, DIGITS)]);
  more.push(["kappa", general(answer.kappa, DIGITS), answer.kappa]);
  if (answer.beta !== undefined) more.push(["beta", quantityText(answer.beta, "beta"), answer.beta]);
  if (answer.A !== undefined) more.push(["A of the pair", quantityText(answer.A, "time", 4), answer.A]);
  if (answer.own !== undefined) more.push([law.symbol, quantityText(answer.own, law.power ? "slowness" : "")]);
  return { numbers: found, "more-numbers": more };
}

const SMALL_SHARE = 0.01; // of g t_c/v: below, weight changes the loss of energy by about 1 % or less

// What is given, and what the speed does: the input is eps at one speed, or the damping.
function explanation() {
  const { power } = answer.law;
  const bodies = input.bodies ? " The bodies give the contact time and the overlap, not eps."
    : answer.fall && !programNow().law ? " With weight, eps is that of the law: a program may give another eps." : "";
  const shares = { "-1": "a smaller share", 0: "the same share", 1: "a larger share" };
  if (input.by === "drop") {
    const [from, to] = [input.height, input.damping].map((height) => quantityText(height, "length"));
    return `The ball falls from ${from} and rebounds to ${to}: eps = sqrt(${to}/${from}) = ${general(Math.sqrt(input.damping / input.height), DIGITS)} with its weight.${bodies}`;
  }
  if (input.by !== "epsilon") return `You gave ${wayNow()[1]}${input.by === "A" ? " and the bodies" : ""}; eps follows from the impact speed.`;
  const faster = answer.fall?.share > SMALL_SHARE ? "Without weight, a faster impact" : "A faster impact";
  const loss = answer.adhesion || !answer.kappa ? "" : ` ${faster} loses ${shares[Math.sign(power)]} of its energy.`;
  return `You gave eps = ${general(input.damping, DIGITS)} at ${quantityText(input.at, "speed")}.${loss}${bodies}`;
}

// Values of the bodies that are not usual: a unit may be missing.
function unusual() {
  if (!input.bodies) return [];
  const entries = input.bodies.flatMap((each, i) => Object.keys(USUAL).map((key) => [key + (i ? "2" : ""), each[key], USUAL[key]]));
  const isOdd = ([id, x, [low, high]]) => $(`row-${id}`).offsetParent && !(x >= low && x <= high);
  return entries.filter(isOdd).map(([id, x, range]) => {
    const [text, low, high] = [x, ...range].map((each) => quantityText(each, FIELDS[id][1]));
    return `${FIELDS[id][0]} ${text}: solid bodies have ${low} to ${high}. Is the unit right?`;
  });
}

function accuracyText() {
  const kernel = FACTS.kernels[FACTS.kernels.length - 1];
  const tables = `with relative errors below ${general(FACTS.tablesError, 2)} (sampled)`;
  if (isPaper(answer.law, input.end)) {
    return `eps comes from our JavaScript export, ${kernel.name}: proven to be within ${kernel.bound} min(eps, 1 - eps). ` +
      `The other numbers come from tables, ${tables}. Contact ends where the force vanishes, before the compression returns to 0.`;
  }
  return `The numbers of this law come from tables, ${tables}.`;
}

function rowOf([name, value, raw]) {
  const row = document.createElement("tr");
  row.append(element("th", name, { scope: "row" }), element("td", value));
  if (raw !== undefined) row.lastChild.dataset.value = raw; // all digits, in SI units
  return row;
}

function show() {
  for (const [id, rowsOf] of Object.entries(rows())) $(id).replaceChildren(...rowsOf.map(rowOf));
  const [epsilon, weight] = input.by === "drop" ? [answer.fall.epsilon, ", with the weight"] : [answer.epsilon, ""];
  $("summary").textContent = `eps = ${general(epsilon, DIGITS)} at ${quantityText(input.speed, "speed")}${weight}`;
  $("explanation").textContent = explanation();
  $("words").classList.toggle("hidden", answer.law !== FACTS.laws[0]);
  $("warnings").replaceChildren(...[...answer.warnings.map((text) => `${text}.`), ...unusual()].map((text) => element("li", text)));
  $("accuracy").textContent = accuracyText();
  $("command").textContent = `${commandOf(answer, input)} --digits 30`;
  showProgram();
  draw();
}

function showProgram() {
  const { line, reason, warning, step, command, scene } = linesOf($("program").value, answer, input);
  $("line").textContent = line || "";
  const program = programNow();
  const ofLaw = [
    answer.fall && "The line gives eps without weight: the command writes one with it (--gravity).",
    !program.texts.any?.includes("{stiffness}") && "The line sets no stiffness: the command does, from the bodies or with --mass.",
    answer.pair && 'To give a contact time instead of the bodies, clear "Bodies are known".',
  ];
  const notes = [warning, step, ...(line && program.law ? ofLaw : []), "In SI units:"];
  $("reason").textContent = reason || notes.filter(Boolean).join(" ");
  for (const id of ["line", "copy-line"]) $(id).classList.toggle("hidden", !line);
  $("simulator").textContent = command || "";
  $("by-scene").classList.toggle("hidden", !scene);
  $("of-simulator").classList.toggle("hidden", !command);
}

// --- curves ------------------------------------------------------------------------------------------------------

const CURVES = [
  { kind: "reference", name: "exact", label: "this law" },
  ...FACTS.pade.map(({ name }) => ({ kind: "pade", name, label: name })),
  ...FACTS.kernels.map(({ name, bound }) => ({ kind: "kernel", name, label: `${name.split("_")[0]} ${bound}` })),
  ...FACTS.laws.map(({ name, title }) => ({ kind: "law", name, label: title })),
].map((curve, i) => ({ ...curve, id: `curve-${i}`, color: `var(--c${i ? 1 + ((i - 1) % 7) : 0})`, dash: ["", "7 3", "2 3", "9 3 2 3"][Math.floor((i + 6) / 7) % 4] }));
const ADHESIVE = { kind: "adhesion", name: "adhesion", label: "this law, with adhesion", id: "curve-adhesion", color: "var(--c0)", dash: "4 3" };

function makeChoices() {
  for (const curve of CURVES.slice(1)) {
    const label = document.createElement("label");
    const box = element("input", "", { type: "checkbox", id: curve.id });
    const swatch = svgOf("svg", { class: "swatch", viewBox: "0 0 26 10", "aria-hidden": "true" });
    const line = svgOf("line", { x1: 0, y1: 5, x2: 26, y2: 5, "stroke-width": 2.5, "stroke-dasharray": curve.dash });
    line.style.stroke = curve.color;
    swatch.append(line);
    label.append(box, " ", swatch, ` ${curve.label}`);
    $(`choose-${curve.kind}`).append(label);
  }
}

const isApproximant = (curve) => curve.kind === "pade" || curve.kind === "kernel";
const shownCurves = () =>
  CURVES.filter((curve, i) => i === 0 || ($(curve.id).checked && !$(curve.id).disabled));

// Slowest and fastest speed of the picture.
function ends() {
  const [low, high] = [positive("from"), positive("to")];
  if (!(low < high)) refuse("to", `the speeds are ${$("from").value} to ${$("to").value}: expected the slowest below the fastest`);
  return [low, high];
}

const SUPERSCRIPTS = { "-": "\u207b", ...Object.fromEntries([..."0123456789"].map((d, i) => [d, "\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079"[i]])) };
const powerOfTen = (n) => (n === 0 ? "1" : n === 1 ? "10" : `10${[...String(n)].map((c) => SUPERSCRIPTS[c]).join("")}`);

// An axis: where a value is (0 to 1), and its ticks with labels.
function axisOf(low, high, isLog, most) {
  if (isLog) {
    const [first, last] = [Math.ceil(Math.log10(low) - 1e-9), Math.floor(Math.log10(high) + 1e-9)];
    const step = Math.max(1, Math.ceil((last - first + 1) / most));
    const ticks = [];
    for (let n = first; n <= last; n += 1) if (n % step === 0) ticks.push([10 ** n, powerOfTen(n)]);
    if (ticks.length < 2) for (const x of [low, high]) ticks.push([x, general(x, 3)]);
    return { at: (x) => Math.log(x / low) / Math.log(high / low), ticks };
  }
  const rough = (high - low) / most;
  const unit = 10 ** Math.floor(Math.log10(rough));
  const step = unit * [1, 2, 5, 10].find((n) => n * unit >= rough);
  const ticks = [];
  for (let n = Math.ceil(low / step - 1e-9); n * step <= high * (1 + 1e-12); n += 1) ticks.push([n * step, general(n * step, 6)]);
  return { at: (x) => (x - low) / (high - low), ticks };
}

function panel(width, height, horizontal, vertical, title, below) {
  const box = { left: 52, right: width - 12, top: 22, bottom: height - (below ? 40 : 12) };
  const picture = svgOf("svg", { viewBox: `0 0 ${width} ${height}`, height, role: "img", "aria-label": title });
  const x = (value) => box.left + (box.right - box.left) * horizontal.at(value);
  const y = (value) => box.bottom - (box.bottom - box.top) * vertical.at(value);
  const id = `clip-${title.length}`;
  const clip = svgOf("clipPath", { id });
  clip.append(svgOf("rect", { x: box.left, y: box.top, width: box.right - box.left, height: box.bottom - box.top }));
  picture.append(clip, svgOf("text", { x: box.left, y: 14 }, title));
  for (const [value, label] of horizontal.ticks) {
    picture.append(svgOf("line", { class: "grid", x1: x(value), x2: x(value), y1: box.top, y2: box.bottom }));
    if (below) picture.append(svgOf("text", { x: x(value), y: box.bottom + 16, "text-anchor": "middle" }, label));
  }
  for (const [value, label] of vertical.ticks) {
    picture.append(svgOf("line", { class: "grid", x1: box.left, x2: box.right, y1: y(value), y2: y(value) }));
    picture.append(svgOf("text", { x: box.left - 6, y: y(value) + 4, "text-anchor": "end" }, label));
  }
  if (below) picture.append(svgOf("text", { x: (box.left + box.right) / 2, y: height - 6, "text-anchor": "middle" }, below));
  picture.append(svgOf("rect", { class: "frame", x: box.left, y: box.top, width: box.right - box.left, height: box.bottom - box.top }));
  const inside = svgOf("g", { "clip-path": `url(#${id})` });
  picture.append(inside);
  const speed = x(input.speed);
  if (speed >= box.left && speed <= box.right) inside.append(svgOf("line", { class: "mark", x1: speed, x2: speed, y1: box.top, y2: box.bottom }));
  return {
    picture,
    dot: (value, height) => inside.append(svgOf("circle", { class: "dot", cx: x(value), cy: y(height), r: 4.5 })),
    curve: ({ color, dash, id: name }, speeds, values) => {
      let path = "";
      let drawn = false;
      speeds.forEach((v, i) => {
        const height = y(values[i]);
        const good = Number.isFinite(height);
        if (good) path += `${drawn ? "L" : "M"}${x(v).toFixed(1)} ${Math.min(Math.max(height, -9999), 9999).toFixed(1)}`;
        drawn = good;
      });
      const line = svgOf("path", { class: "curve", d: path, "stroke-dasharray": dash, "data-curve": name });
      line.style.stroke = color;
      inside.append(line);
    },
  };
}

const LEAST_ERROR = 1e-10; // below, the tables that errors are measured against are not accurate enough

function draw() {
  const paper = isPaper(answer.law, input.end);
  for (const curve of CURVES.slice(1)) {
    $(curve.id).disabled = isApproximant(curve) ? !paper : curve.name === answer.law.name;
  }
  const [low, high] = ends();
  const isLog = $("logarithmic").checked;
  const speeds = range(low, high, 241, isLog);
  const curves = [...shownCurves(), ...(answer.adhesion ? [ADHESIVE] : [])];
  const values = curves.map((curve) => curveAt(curve, answer, input, speeds));
  const here = curves.map((curve) => curveAt(curve, answer, input, [input.speed])[0]);
  const width = Math.max($("plot").clientWidth, 280);
  const unit = unitOf("speed", input.system);
  const shown = ([lowest, highest]) => axisOf(lowest, highest, isLog, Math.floor(width / 75));
  const horizontal = shown([low, high]);
  const scale = factorOf("speed", unit);
  const labels = axisOf(low / scale, high / scale, isLog, Math.floor(width / 75));
  horizontal.ticks = labels.ticks.map(([value, label]) => [value * scale, label]);
  const own = values[0].filter((e) => e > 0);
  const vertical = verticalAxis(own);
  const below = `impact speed in ${unit}`;
  const alone = curves.length === 1;
  const first = panel(width, alone ? 310 : 270, horizontal, vertical, "eps", alone ? below : null);
  curves.forEach((curve, i) => first.curve(curve, speeds, values[i]));
  first.dot(input.speed, answer.epsilon);
  const differences = values.map((each) => each.map((e, i) => Math.abs(e / values[0][i] - 1)));
  const errors = errorAxis(differences.slice(1).flat().filter((e) => e > LEAST_ERROR && e < Infinity));
  const second = panel(width, 220, horizontal, errors, "relative difference from this law", below);
  curves.slice(1).forEach((curve, i) => second.curve(curve, speeds, differences[i + 1]));
  $("shown").classList.toggle("hidden", alone);
  $("plot").replaceChildren(first.picture, ...(alone ? [] : [second.picture]));
  $("shown").tBodies[0].replaceChildren(...curves.map((curve, i) => curveRow(curve, i ? here[i] : answer.epsilon, here[0], i)));
}

function errorAxis(found) {
  const sorted = found.sort((a, b) => a - b);
  const decade = (x) => Math.log10(x || 1e-8);
  const high = Math.min(Math.ceil(decade(sorted[sorted.length - 1])), 1);
  const low = Math.min(Math.floor(decade(sorted[Math.floor(sorted.length / 20)])), high - 2);
  return axisOf(10 ** low, 10 ** high, true, 6);
}

function verticalAxis(own) {
  const way = $("vertical").value;
  const [least, most] = own.length ? [Math.min(...own), Math.max(...own)] : [0, 1];
  if (way === "log") return axisOf(Math.min(Math.max(least / 2, 1e-8), 0.1), 1, true, 6);
  if (way === "linear") return axisOf(0, 1, false, 5);
  const margin = Math.max(0.06 * (most - least), 1e-6 * most);
  return axisOf(least - margin, most + margin, false, 8);
}

function curveRow(curve, value, reference, index) {
  const row = document.createElement("tr");
  const difference = value / reference - 1;
  const known = Number.isFinite(value);
  const size = !index ? "" : !known ? "" : Math.abs(difference) < LEAST_ERROR ? `below ${LEAST_ERROR}` : general(difference, 3);
  row.append(element("td", index ? curve.label : `${MARK} ${answer.law.title}`), element("td", known ? general(value, DIGITS) : "none here"), element("td", size));
  return row;
}

// --- state -------------------------------------------------------------------------------------------------------

const defaults = {};

// The default of a field in the chosen units.
function defaultOf(id) {
  const [dimension, text] = [FIELDS[id]?.[1], defaults[id]];
  if (!dimension || !text || $("system").value === defaults.system) return text;
  return general(inUnit(parseQuantity(id, id, text, dimension, defaults.system), dimension, $("system").value), 12);
}

const curveState = () => CURVES.slice(1).filter((curve) => $(curve.id).checked).map((curve) => curve.name).join("+");

function save() {
  const words = new URLSearchParams();
  for (const id of STATE) if (valueOf(id) !== defaultOf(id)) words.set(id, valueOf(id));
  if (curveState() !== defaults.curves) words.set("curves", curveState());
  const hash = String(words);
  history.replaceState(null, "", hash ? `#${hash}` : location.pathname + location.search);
}

function load() {
  const words = new URLSearchParams(location.hash.slice(1));
  const given = (id) => words.get(id) ?? defaultOf(id);
  for (const id of ["law", "end", "system"]) setIfKnown(id, given(id));
  choose($("by"), Object.entries(ways(lawOf($("law").value))).map(([value, [text]]) => [value, text]));
  for (const id of STATE.slice(3)) setIfKnown(id, given(id));
  const curves = new Set((words.get("curves") ?? defaults.curves).split("+"));
  for (const curve of CURVES.slice(1)) $(curve.id).checked = curves.has(curve.name);
  system = $("system").value;
  // What was read is in the fields now; name the rest.
  const isRead = ([id, value]) => (id === "curves" ? value.split("+").every((name) => !name || curveState().split("+").includes(name)) : STATE.includes(id) && valueOf(id) === value);
  const rest = [...words].filter((setting) => !isRead(setting)).map((setting) => setting.join("="));
  $("unread").textContent = rest.length ? `The page does not know these settings of its address: ${rest.join(", ")}.` : "";
}

function setIfKnown(id, value) {
  const field = $(id);
  if (field.tagName !== "SELECT") setValue(id, value);
  else if ([...field.options].some((option) => option.value === value)) field.value = value;
  else field.selectedIndex = 0;
}

// --- changes -----------------------------------------------------------------------------------------------------

// Another unit system: plain numbers are converted, those with a unit stay.
function changeUnits() {
  const next = $("system").value;
  for (const id of [...Object.keys(FIELDS), "damping"]) {
    const dimension = dimensionOf(id);
    if (!dimension || !/^[^a-z(]*(e[+-]?\d+)?\s*$/i.test($(id).value) || !$(id).value.trim()) continue;
    try {
      $(id).value = general(inUnit(parseQuantity(id, id, $(id).value, dimension, system), dimension, next), 12);
    } catch (error) {
      if (!(error instanceof Refused)) throw error;
    }
  }
  system = next;
}

// With another law, or another way to give the damping, eps at the impact speed stays the same; a drop has its own speed
// of impact, and the damping stays.
function changeWay(by) {
  const possible = ways(lawOf($("law").value));
  choose($("by"), Object.entries(possible).map(([value, [text]]) => [value, text]));
  const old = answer;
  $("by").value = by in possible ? by : "epsilon";
  if (!old) return;
  try {
    const law = lawOf($("law").value);
    const epsilon = byTable(old, input);
    const same = { ...input, law: law.name, end: $("end").value, by: "epsilon", damping: epsilon, at: input.speed };
    const height = $("by").value === "drop" ? positive("height") : null;
    if (old.fall && height) same.speed = Math.sqrt(2 * input.gravity * height);
    const found = $("by").value === "epsilon" ? { epsilon } : calculate(same);
    const values = { epsilon, drop: height * (found.fall?.epsilon ?? found.epsilon) ** 2, A: found.A, beta: found.beta, own: found.own, kappa: law === FACTS.laws[0] ? found.vStar : found.kappa };
    const value = values[$("by").value];
    $("at").value = $("speed").value;
    // A law without Hertz's force begins with the contact time of the spheres.
    if (old.contactTime && !$("contact").value) $("contact").value = general(inUnit(old.contactTime, "time", $("system").value), 4);
    if (value !== undefined) $("damping").value = general(inUnit(value, wayNow()[2], $("system").value), 10);
  } catch (error) {
    if (!(error instanceof Refused)) throw error;
  }
}

function arrange() {
  const law = lawOf($("law").value);
  const by = $("by").value;
  $("equation").textContent = `${law.equation}, nu = ${law.nu}${law.ends.return ? "" : ": both ends of contact are the same"}`;
  $("end").disabled = !law.ends.return;
  $("label-damping").textContent = wayNow()[1] + shownUnit(wayNow()[2]);
  $("label-speed").textContent = `Impact speed${shownUnit("speed")}${by === "drop" ? ", from the height" : ""}`;
  $("row-at").classList.toggle("hidden", by !== "epsilon");
  for (const id of ["row-height", "row-other"]) $(id).classList.toggle("hidden", by !== "drop");
  for (const id of ["speed", "slide-speed"]) $(id).disabled = by === "drop";
  const hasBodies = isHertz(law) && $("bodies").checked;
  $("bodies-section").classList.toggle("hidden", !isHertz(law));
  $("row-contact").classList.toggle("hidden", hasBodies);
  for (const id of Object.keys(FIELDS)) {
    const label = document.querySelector(`label[for="${id}"]`);
    label.dataset.text ??= label.textContent;
    if (id !== "speed") label.textContent = label.dataset.text + shownUnit(FIELDS[id][1]);
  }
  const kind = $("kind").value;
  $("of-bodies").classList.toggle("hidden", !$("bodies").checked);
  $("of-other").classList.toggle("hidden", kind === "same" || kind === "wall");
  const used = { radius2: ["size", "sphere"], density2: ["sphere"], young2: ["sphere", "otherwall"], poisson2: ["sphere", "otherwall"] };
  for (const [id, kinds] of Object.entries(used)) $(`row-${id}`).classList.toggle("hidden", !kinds.includes(kind));
  $("row-adhesion").classList.toggle("hidden", by === "drop" || !isPaper(law, $("end").value)); // a drop is read without
  $("row-gravity").classList.toggle("hidden", hasBodies && !["wall", "otherwall"].includes(kind));
  $("row-second").classList.toggle("hidden", by !== "A" || !used.young2.includes(kind));
}

function update() {
  arrange();
  for (const field of document.querySelectorAll("[aria-invalid]")) {
    field.removeAttribute("aria-invalid");
    field.removeAttribute("aria-describedby");
  }
  try {
    const found = read();
    ends();
    answer = calculate(found);
    input = found;
    placeSlider("speed", input.speed);
    placeSlider("damping", input.damping);
    $("problem").textContent = "";
    show();
  } catch (error) {
    if (!(error instanceof Refused)) throw error;
    $("problem").textContent = error.message;
    $(error.field)?.setAttribute("aria-invalid", "true");
    $(error.field)?.setAttribute("aria-describedby", "problem");
  }
  const bad = $("problem").textContent !== "";
  for (const id of ["good", "picture", "program-section"]) $(id).classList.toggle("hidden", bad);
  clearTimeout(saving);
  saving = setTimeout(save, 250); // browsers refuse an address that changes with every move of a slider
}

function copy(id, what) {
  if (id === "link") save();
  const text = id === "link" ? location.href : $(id).textContent;
  navigator.clipboard.writeText(text).then(
    () => ($("copied").textContent = `Copied ${what}.`),
    () => ($("copied").textContent = "The browser does not let this page copy: select the text."),
  );
}

function start() {
  choose($("law"), FACTS.laws.map(({ name, title }) => [name, title]));
  choose($("system"), Object.keys(FACTS.systems).map((name) => [name, name]));
  choose($("program"), FACTS.programs.map(({ name, title }) => [name, title]));
  choose($("by"), Object.entries(ways(FACTS.laws[0])).map(([value, [text]]) => [value, text]));
  makeChoices();
  for (const id of STATE) defaults[id] = valueOf(id);
  defaults.curves = curveState();
  load();
  document.addEventListener("input", ({ target }) => {
    if (target.id.startsWith("slide-")) slide(target.id.slice("slide-".length));
    if (target.id === "system") changeUnits();
    if (target.id === "law") changeWay($("by").value === "kappa" ? "kappa" : "epsilon");
    if (target.id === "by") changeWay($("by").value);
    update();
  });
  for (const [id, what] of Object.entries({ command: "the command", line: "the lines", simulator: "the command", link: "the link" }))
    $(`copy-${id}`).addEventListener("click", () => copy(id, what));
  window.addEventListener("hashchange", () => {
    load();
    update();
  });
  new ResizeObserver(() => answer && !$("picture").classList.contains("hidden") && draw()).observe($("picture"));
  update();
}

start();
