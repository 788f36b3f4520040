// Checks the functions of a module against test vectors. From the repository's root:
//
//     node examples/vectors/check.mjs exports/vectors_compact.json [MODULE.mjs]
//
// Vectors of functions that the module lacks are skipped. Exit status: 0 if all pass.
import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

// The number that C prints as 0x1.8p+1; also nan, inf, -inf.
function numberOf(text) {
    const parts = /^(-?)0x([01])\.?([0-9a-f]*)p([+-][0-9]+)$/.exec(text);
    if (!parts) {
        return { inf: Infinity, "-inf": -Infinity }[text] ?? NaN;
    }
    const [, sign, whole, digits, exponent] = parts;
    // Both factors are exact, and so is the product: digits of subnormal numbers are few.
    const value = parseInt(whole + digits, 16) * 2 ** (Number(exponent) - 4 * digits.length);
    return sign ? -value : value;
}

const same = (x, y) => x === y || (Number.isNaN(x) && Number.isNaN(y));
const [vectors, module] = process.argv.slice(2);
if (!vectors) {
    console.error("usage: node check.mjs VECTORS.json [MODULE.mjs]");
    process.exit(2);
}
async function read(path, reader) {
    try {
        return await reader();
    } catch (error) {
        console.error(`cannot read ${path}: ${error.message}`);
        process.exit(2);
    }
}
const found = await read(vectors, () => JSON.parse(readFileSync(vectors, "utf8")).vectors.values());
const code = module ? pathToFileURL(module) : new URL("../../exports/viscopade.mjs", import.meta.url);
const functions = await read(module ?? code, () => import(code));
let all = 0;
let passed = 0;
for (const vector of found) {
    const [name, type, x, y, , , , leastText, mostText, bits] = vector;
    if (type !== "double" || !(name in functions)) {
        continue;
    }
    const result = functions[name](numberOf(x), numberOf(y));
    const [least, most] = [numberOf(leastText), numberOf(mostText)];
    const within = Number.isNaN(least) ? Number.isNaN(result) : least <= result && result <= most;
    const pass = (leastText === "-" || within) && (bits === "-" || same(result, numberOf(bits)));
    all += 1;
    passed += pass;
    if (!pass) {
        console.log(`${result}: ${JSON.stringify(vector)}`);
    }
}
console.log(`${passed} of ${all} pass`);
if (all === 0) {
    console.error("no vector is of a function of the module: give its file as the second argument");
}
process.exit(passed === all && all > 0 ? 0 : 1);
