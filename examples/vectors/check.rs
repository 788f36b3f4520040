// Checks the functions of a module against test vectors. From the repository's root:
//
//     rustc -O examples/vectors/check.rs -o check && ./check exports/vectors_compact.json
//
// Vectors of functions that are not in FUNCTIONS are skipped. For your own port, change the path below and
// FUNCTIONS. Exit status: 0 if all pass.
#[allow(dead_code)]
#[path = "../../exports/viscopade.rs"]
mod viscopade;

/// Name and type of a function as in the vectors, and its call; a function of one argument uses only x.
const FUNCTIONS: &[(&str, &str, fn(f64, f64) -> f64)] = &[
    ("restitution_compact_1em3", "double", |x, y| viscopade::restitution_compact_1em3(x, y)),
    ("rebound_compact_1em3", "double", |x, y| viscopade::rebound_compact_1em3(x, y)),
    ("dissipation_compact_1em3", "double", |x, y| viscopade::dissipation_compact_1em3(x, y)),
    ("restitution_compact_1em5", "double", |x, y| viscopade::restitution_compact_1em5(x, y)),
    ("rebound_compact_1em5", "double", |x, y| viscopade::rebound_compact_1em5(x, y)),
    ("dissipation_compact_1em5", "double", |x, y| viscopade::dissipation_compact_1em5(x, y)),
    ("restitution_compact_1em7", "double", |x, y| viscopade::restitution_compact_1em7(x, y)),
    ("rebound_compact_1em7", "double", |x, y| viscopade::rebound_compact_1em7(x, y)),
    ("dissipation_compact_1em7", "double", |x, y| viscopade::dissipation_compact_1em7(x, y)),
    ("restitution_compact_1em3", "float", |x, y| viscopade::restitution_compact_1em3_f32(x as f32, y as f32).into()),
    ("rebound_compact_1em3", "float", |x, y| viscopade::rebound_compact_1em3_f32(x as f32, y as f32).into()),
    ("dissipation_compact_1em3", "float", |x, y| viscopade::dissipation_compact_1em3_f32(x as f32, y as f32).into()),
    ("restitution_compact_1em5", "float", |x, y| viscopade::restitution_compact_1em5_f32(x as f32, y as f32).into()),
    ("rebound_compact_1em5", "float", |x, y| viscopade::rebound_compact_1em5_f32(x as f32, y as f32).into()),
    ("dissipation_compact_1em5", "float", |x, y| viscopade::dissipation_compact_1em5_f32(x as f32, y as f32).into()),
];

/// The number that C writes as 0x1.8p+1; also nan, inf, -inf.
fn number_of(text: &str) -> f64 {
    let positive = text.trim_start_matches('-');
    let sign = if positive.len() < text.len() { -1.0 } else { 1.0 };
    let Some((mantissa, exponent)) = positive.strip_prefix("0x").and_then(|rest| rest.split_once('p')) else {
        return sign * if positive == "inf" { f64::INFINITY } else { f64::NAN };
    };
    let (whole, digits) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let mut value = u64::from_str_radix(&format!("{whole}{digits}"), 16).expect("hexadecimal digits") as f64;
    let exponent = exponent.parse::<i32>().expect("an exponent") - 4 * digits.len() as i32;
    for _ in 0..exponent.abs() {
        value *= if exponent < 0 { 0.5 } else { 2.0 }; // exact
    }
    sign * value
}

fn main() {
    let Some(path) = std::env::args().nth(1) else {
        eprintln!("usage: check VECTORS.json");
        std::process::exit(2);
    };
    let text = std::fs::read_to_string(&path).unwrap_or_else(|error| {
        eprintln!("cannot read {path}: {error}");
        std::process::exit(2);
    });
    if !text.trim_end().ends_with("]}") {
        eprintln!("cannot read {path}: it does not end as vectors do");
        std::process::exit(2);
    }
    let (mut all, mut passed) = (0, 0);
    for line in text.lines() {
        // function, type, x, y, exact, nearest, error, least, most, bits; "-" where there is none
        let texts: Vec<&str> = line.split('"').skip(1).step_by(2).collect();
        if !line.starts_with("[\"") || texts.len() != 10 {
            continue;
        }
        let Some((_, _, function)) = FUNCTIONS.iter().find(|known| known.0 == texts[0] && known.1 == texts[1]) else {
            continue;
        };
        let result = function(number_of(texts[2]), number_of(texts[3]));
        let (least, most, bits) = (number_of(texts[7]), number_of(texts[8]), number_of(texts[9]));
        let within = if least.is_nan() { result.is_nan() } else { least <= result && result <= most };
        let same = result == bits || (result.is_nan() && bits.is_nan());
        let pass = (texts[7] == "-" || within) && (texts[9] == "-" || same);
        all += 1;
        passed += i32::from(pass);
        if !pass {
            println!("{result:e}: {line}");
        }
    }
    println!("{passed} of {all} pass");
    if all == 0 {
        eprintln!("no vector is of a function in FUNCTIONS: change the path of the module and FUNCTIONS");
    }
    std::process::exit(if passed == all && all > 0 { 0 } else { 1 });
}
