//! Functions at eight points at a time against one point: random programs, every `internal(n)`, and the transcendental
//! functions against their bounds. Seeded: a program that fails is named by its seed and its text.

use octray::eval::{self, Options};
use octray::lane::{LANES, Lane, Vec3, f64x8};
use octray::scene::function::{Function, Surroundings};
use octray::scene::pattern::Pattern;
use octray::scene::{PigmentKind, internal};
use octray::texture::function_values;
use std::sync::Arc;

/// More than any of the programs takes.
const STEPS: u64 = 1 << 20;

/// `function { body }` as a pattern has it.
fn function(before: &str, body: &str) -> Arc<Function> {
    let text = format!(
        "#version 3.7; {before}\nplane {{ y, 0 pigment {{ function {{ {body} }} color_map {{ [0 rgb 0] [1 rgb 1] }} }} }}"
    );
    let read = eval::from_text("function", &text, &Options::default());
    assert!(!read.has_errors(), "{text}: {:?}", read.diagnostics);
    let texture = read.scene.objects[0].texture.as_ref().unwrap();
    let PigmentKind::Mapped(mapped) = &texture.layers[0].pigment.kind else { panic!("{text}") };
    let Pattern::Function(function) = &mapped.pattern else { panic!("{text}") };
    function.clone()
}

fn alone(function: &Function, point: [f64; 3]) -> f64 {
    let mut around = Surroundings::new(STEPS, &|_, _| [0.0; 5]);
    function.value(&point, &mut around).unwrap_or(0.0)
}

struct Random(u64);

impl Random {
    /// Below `n`.
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((self.0 >> 33) as usize) % n
    }

    fn unit(&mut self) -> f64 {
        self.below(1 << 30) as f64 / (1u64 << 30) as f64
    }

    fn pick<'a>(&mut self, of: &[&'a str]) -> &'a str {
        of[self.below(of.len())]
    }

    /// Usual numbers, and those where arithmetic ends.
    fn number(&mut self) -> f64 {
        match self.below(16) {
            0 => 0.0,
            1 => -0.0,
            2 => f64::INFINITY,
            3 => f64::NAN,
            4 => 1e300 * (self.unit() - 0.5),
            5 => 1e-310,
            6 => self.below(7) as f64 - 3.0,
            7 => 1e10 * (self.unit() - 0.5),
            _ => 8.0 * (self.unit() - 0.5),
        }
    }

    fn points(&mut self) -> [[f64; 3]; LANES] {
        // Some packets go one way, some apart.
        let near = self.below(3) == 0;
        let centre = [self.number(), self.number(), self.number()];
        std::array::from_fn(|_| match near {
            true => centre.map(|c| c + 1e-3 * self.unit()),
            false => [self.number(), self.number(), self.number()],
        })
    }

    /// An expression of what is the same in lanes to the bit.
    fn expression(&mut self, depth: usize, names: &[String]) -> String {
        if depth == 0 || self.below(12) == 0 {
            return match self.below(3) {
                0 => format!("{:.3}", 6.0 * self.unit()),
                _ => names[self.below(names.len())].clone(),
            };
        }
        let d = depth - 1;
        match self.below(14) {
            0..=3 => {
                let f = self.pick(&["+", "-", "*", "/"]);
                format!("({} {f} {})", self.expression(d, names), self.expression(d, names))
            }
            4 => {
                let f = self.pick(&["<", "<=", ">", ">=", "=", "!=", "&", "|"]);
                format!("({} {f} {})", self.expression(d, names), self.expression(d, names))
            }
            5 => {
                let f = self
                    .pick(&["sqrt", "abs", "ceil", "floor", "int", "sqr", "degrees", "radians", "-", "!"]);
                format!("{f}({})", self.expression(d, names))
            }
            6 => {
                let f = self.pick(&["asin", "acos", "atan", "tan", "sinh", "cosh", "tanh", "log", "asinh"]);
                format!("{f}({})", self.expression(d, names))
            }
            7 => {
                let f = self.pick(&["min", "max", "mod", "div", "atan2", "pow"]);
                format!("{f}({}, {})", self.expression(d, names), self.expression(d, names))
            }
            8 => format!("mod({}, 1)", self.expression(d, names)),
            9 | 10 => {
                let choices: Vec<_> = (0..3 + self.below(2)).map(|_| self.expression(d, names)).collect();
                format!("select({})", choices.join(", "))
            }
            11 => {
                let variable = format!("I{depth}");
                let (from, to) = (self.expression(0, names), self.below(4));
                let inner: Vec<_> = names.iter().cloned().chain([variable.clone()]).collect();
                // Lanes leave the loop one by one.
                let to = format!("min({to}, {})", self.expression(d.min(1), names));
                let body = self.expression(d, &inner);
                let which = self.pick(&["sum", "prod"]);
                format!("{which}({variable}, max(-3, {from}), {to}, {body})")
            }
            12 => format!(
                "F({}, {}, {})",
                self.expression(d, names),
                self.expression(d, names),
                self.expression(d, names)
            ),
            _ => {
                let f = self.pick(&["Torus", "Box", "Curve", "Noise", "Turned", "Path"]);
                let call = match f {
                    "Torus" => "Torus(@, 1.1, 0.3)",
                    "Box" => "Box(@, 0.1, 0.4, 0.45, 0.5)",
                    "Curve" => "Curve(@, 1.1, 0.7, 1.3, z > 0, 0.3, 20)",
                    "Noise" => "Noise(@)",
                    "Turned" => "Turned(@).y",
                    _ => return format!("Path({}).z", self.expression(d, names)),
                };
                let point: Vec<_> = (0..3).map(|_| self.expression(d.min(2), names)).collect();
                call.replace('@', &point.join(", "))
            }
        }
    }
}

const DECLARED: &str = "
#declare Torus = function { internal(70) }
#declare Box = function { internal(60) }
#declare Curve = function { internal(15) }
#declare Noise = function { internal(76) }
#declare Turned = function { transform { rotate <10, 20, 30> translate <1, 2, 3> } }
#declare Path = function { spline { natural_spline 0, <0, 1, 2>, 0.5, <3, 1, -1>, 1, <0, 0, 2> } }
#declare F = function(x, y, z) { select(x - y, sum(K, 0, min(5, abs(z)), K * x), x * y - z) }
";

/// The same number, or neither is one: what bits a NaN has, no scene can tell.
fn same(a: f64, b: f64) -> bool {
    a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan()
}

#[test]
fn lanes_come_to_the_bits_of_points_alone() {
    let programs = std::env::var("OCTRAY_RANDOM_PROGRAMS").ok().and_then(|n| n.parse().ok()).unwrap_or(400);
    let names = ["x", "y", "z"].map(String::from);
    let (mut numbers, mut values) = (0, 0);
    for seed in 0..programs {
        let mut random = Random(seed);
        let text = random.expression(5, &names);
        let function = function(DECLARED, &text);
        for _ in 0..20 {
            let points = random.points();
            let axis = |i: usize| f64x8::from_fn(|k| points[k][i]);
            let found = function_values(&function, Vec3::new(axis(0), axis(1), axis(2)), STEPS).to_array();
            for k in 0..LANES {
                let expected = alone(&function, points[k]);
                assert!(
                    same(found[k], expected),
                    "seed {seed} at {:?}: {} for {expected}\n{text}",
                    points[k],
                    found[k]
                );
                values += 1;
                numbers += usize::from(expected.is_finite() && expected != 0.0);
            }
        }
    }
    // Most programs must be about something.
    assert!(numbers * 3 > values, "only {numbers} of {values} values are plain numbers");
}

#[test]
fn internal_functions_come_to_the_same_bits_in_lanes() {
    let mut random = Random(7);
    for number in (0..=78).filter(|number| internal::is_modelled(*number)) {
        for _ in 0..50 {
            let arguments: [[f64; LANES]; 16] =
                std::array::from_fn(|_| std::array::from_fn(|_| random.number()));
            let found = internal::value(number, &arguments.map(f64x8::from_array)).unwrap().to_array();
            for k in 0..LANES {
                let own = arguments.map(|a| a[k]);
                let expected = internal::value(number, &own).unwrap();
                assert!(
                    same(found[k], expected),
                    "internal({number}) at {own:?}: {} for {expected}",
                    found[k]
                );
            }
        }
    }
}

#[test]
fn a_lane_that_takes_too_long_counts_as_nothing() {
    let function = function("", "sum(I, 0, x, 1)");
    let x = f64x8::from_fn(|k| if k % 2 == 0 { 1e9 } else { k as f64 });
    let found = function_values(&function, Vec3::new(x, f64x8::zero(), f64x8::zero()), 1000).to_array();
    assert_eq!(found, [0.0, 2.0, 0.0, 4.0, 0.0, 6.0, 0.0, 8.0]);
}

/// Some lanes call further than others, and one without end.
#[test]
fn functions_that_call_themselves_come_to_the_same_bits_in_lanes() {
    let declared = "#declare Half = function(a) { select(a - 1, a, 1 + Half(a/2)) }
        #declare Endless = function(a) { select(a - 5, Half(a + 3), Endless(a)) }";
    let function = function(declared, "Endless(x) + y");
    let x = [0.5, 1.0, 3.0, -7.0, 4.5, 5.0, f64::NAN, f64::INFINITY];
    let (x, y) = (f64x8::from_array(x), f64x8::from_array([0.25; 8]));
    let found = function_values(&function, Vec3::new(x, y, f64x8::zero()), STEPS).to_array();
    for (found, x) in found.into_iter().zip(x.to_array()) {
        let expected = alone(&function, [x, 0.25, 0.0]);
        assert!(same(found, expected), "{x}: {found} for {expected}");
    }
    assert_eq!(found[5], 0.0, "without a value");
    assert!(found[..5].iter().all(|found| *found != 0.0), "{found:?}");
}

/// What is computed in lanes by its own formula, with the bounds that src/texture/function.rs states.
#[test]
fn transcendental_functions_keep_their_bounds() {
    let (tiny, small) = (2f64.powi(-51), 2f64.powi(-52));
    // Body, arguments from and to, relative and absolute bound.
    let table = [
        ("sin(x)", -10.0, 10.0, 0.0, small),
        ("sin(x)", -65536.0, 65536.0, 0.0, small),
        ("cos(x)", -10.0, 10.0, 0.0, small),
        ("cos(x)", -65536.0, 65536.0, 0.0, small),
        ("exp(x)", -1.0, 1.0, tiny, 0.0),
        ("exp(x)", -700.0, 700.0, tiny, 0.0),
        ("ln(x)", 0.5, 2.0, tiny, small),
        ("ln(x)", 1e-300, 1e-3, tiny, small),
        ("ln(x)", 1.0, 1e300, tiny, small),
        ("pow(x, 2)", -9.0, 9.0, 2.0 * small / 2.0, 0.0),
        ("pow(x, 7)", -9.0, 9.0, 7.0 * small / 2.0, 0.0),
        ("pow(x, 16)", -9.0, 9.0, 16.0 * small / 2.0, 0.0),
    ];
    let mut random = Random(3);
    for (body, from, to, relative, absolute) in table {
        let function = function("", body);
        let mut worst = 0.0f64;
        for _ in 0..20_000 {
            let x = f64x8::from_fn(|_| from + (to - from) * random.unit());
            let found = function_values(&function, Vec3::new(x, x, x), STEPS).to_array();
            for (x, found) in x.to_array().into_iter().zip(found) {
                let expected = alone(&function, [x; 3]);
                let bound = relative * expected.abs() + absolute;
                worst = worst.max((found - expected).abs() / bound);
            }
        }
        println!("{body} from {from} to {to}: {worst:.2} of its bound");
        assert!(worst <= 1.0, "{body} from {from} to {to}: {worst} of its bound");
    }
}

/// What patterns ask for by themselves.
#[test]
fn sines_and_powers_of_patterns_keep_their_bounds() {
    use octray::scene::number::Number;
    let mut random = Random(4);
    let (mut of_sines, mut of_powers) = (0.0f64, 0.0f64);
    for _ in 0..20_000 {
        let x = f64x8::from_fn(|_| random.unit());
        let exponent = 0.2 + 2.0 * random.unit();
        let (sines, powers) = (Number::sine(x * 20.0 - 10.0), Number::raised(x, exponent));
        for (k, x) in x.to_array().into_iter().enumerate() {
            of_sines = of_sines.max((sines.to_array()[k] - (x * 20.0 - 10.0).sin()).abs() / 2f64.powi(-52));
            let power = x.powf(exponent);
            let bound = 2f64.powi(-50) * power * (1.0 + power.ln().abs());
            of_powers = of_powers.max((powers.to_array()[k] - power).abs() / bound);
        }
    }
    println!("sines {of_sines:.2}, powers {of_powers:.2} of their bounds");
    assert!(of_sines <= 1.0 && of_powers <= 1.0, "{of_sines} {of_powers}");
    assert_eq!(<f64x8 as Number>::raised(Lane::zero(), 0.77).to_array(), [0.0; 8]);
}
