// Checks the functions of a module against test vectors. From the repository's root:
//
//     rustc -O examples/vectors/check.rs -o check && ./check exports/vectors_half_line.json
//
// Vectors of functions that are not named in FUNCTIONS are left out. Exit status: 0 if all pass.
#[allow(dead_code)]
#[path = "../../exports/viscopade.rs"]
mod viscopade;

type Function = fn(f64, f64) -> f64;

macro_rules! of_double {
    ($($name:ident),*) => { [$((stringify!($name), "double", viscopade::$name as Function)),*] };
}
macro_rules! of_float {
    ($($name:ident = $rust:ident),*) => {
        [$((stringify!($name), "float", (|x, y| viscopade::$rust(x as f32, y as f32) as f64) as Function)),*]
    };
}

const DOUBLE: [(&str, &str, Function); 9] = of_double!(
    restitution_compact_2p09em4, rebound_compact_2p09em4, dissipation_compact_2p09em4,
    restitution_compact_3p4em6, rebound_compact_3p4em6, dissipation_compact_3p4em6,
    restitution_compact_2p79em8, rebound_compact_2p79em8, dissipation_compact_2p79em8
);
const FLOAT: [(&str, &str, Function); 6] = of_float!(
    restitution_compact_2p09em4 = restitution_compact_2p09em4_f32,
    rebound_compact_2p09em4 = rebound_compact_2p09em4_f32,
    dissipation_compact_2p09em4 = dissipation_compact_2p09em4_f32,
    restitution_compact_3p4em6 = restitution_compact_3p4em6_f32,
    rebound_compact_3p4em6 = rebound_compact_3p4em6_f32,
    dissipation_compact_3p4em6 = dissipation_compact_3p4em6_f32
);

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
    let path = std::env::args().nth(1).expect("usage: check VECTORS.json");
    let (mut all, mut passed) = (0, 0);
    for line in std::fs::read_to_string(path).expect("a file of vectors").lines() {
        // function, type, x, y, exact, nearest, error, least, most, bits; "-" where there is none
        let texts: Vec<&str> = line.split('"').skip(1).step_by(2).collect();
        if !line.starts_with("[\"") || texts.len() != 10 {
            continue;
        }
        let named = |known: &&(&str, &str, Function)| known.0 == texts[0] && known.1 == texts[1];
        let Some((_, _, function)) = DOUBLE.iter().chain(FLOAT.iter()).find(named) else {
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
    std::process::exit(if passed == all && all > 0 { 0 } else { 1 });
}
