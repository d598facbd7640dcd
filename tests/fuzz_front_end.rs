//! Any text may be fed to the front end: no panic, no hang, no memory beyond the limits.
//!
//! Inputs are scenes of this repository (and of an installed POV-Ray, in a long run) with pieces cut, doubled, swapped,
//! spliced and overwritten, and plain noise. `OCTRAY_FUZZ_SECONDS` is the budget (default 3), `OCTRAY_FUZZ_SEED` picks
//! the sequence. What fails is written to the folder for temporary files, and the test says where.

use octray::eval::{Limits, Options, from_text};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// One input may take this long: the limits below stop a script after well under a second, on a busy machine.
const HANG: Duration = Duration::from_secs(30);

/// Kilobytes the whole process may hold: twice what the limits allow one script.
const MEMORY_KB: u64 = 1_500_000;

/// What is put in at random places.
const PIECES: &[&str] = &[
    "{",
    "}",
    "(",
    ")",
    "<",
    ">",
    "[",
    "]",
    ",",
    ";",
    "\"",
    "/*",
    "*/",
    "//",
    "#",
    "#end ",
    "#if(1) ",
    "#else ",
    "#while(1) ",
    "#for(I,1,1e9) ",
    "#macro M(A) ",
    "M(",
    "#declare A = ",
    "#local A = ",
    "#include \"",
    "#break ",
    "#switch(2) ",
    "#case(2) ",
    "#undef A ",
    "#ifdef(A) ",
    "#read(",
    "#write(",
    "#fopen F \"x\" write ",
    "array[",
    "array[1e9]",
    "A[",
    "1e308",
    "-1e308",
    "1e-320",
    "nan",
    "0/0",
    "1/0",
    "4294967296",
    "-1",
    "0",
    "rgb ",
    "x*",
    "sphere{0,1}",
    "union{",
    "object{",
    "texture{",
    "pigment{",
    "finish{",
    "normal{",
    "color_map{",
    "function{",
    "mesh2{",
    "vertex_vectors{",
    "polygon{",
    "prism{",
    "lathe{",
    "blob{",
    "text{",
    "spline{",
    "concat(",
    "str(",
    "vstr(",
    "substr(",
    "chr(",
    "vrotate(",
    "min(",
    "select(",
    "rand(",
    "seed(",
    "dimension_size(",
    "trace(",
    "translate ",
    "rotate ",
    "scale 0 ",
    "matrix<",
    "transform{",
    "#version 3.0;",
    "#default{",
    "#debug ",
    "\u{e9}",
    "\u{0}",
    "\\",
    "\n",
    "sum(i,1,1e9,i)",
    "?",
    ":",
    "|",
    "&",
    "!",
    "=",
];

/// SplitMix64 (Steele, Lea, Flood, Fast splittable pseudorandom number generators).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// In 0..n, or 0 if there is none.
    fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }

    /// A range of at most `longest` bytes.
    fn range(&mut self, len: usize, longest: usize) -> std::ops::Range<usize> {
        let start = self.below(len + 1);
        start..(start + self.below(longest)).min(len)
    }
}

/// Scene files below a folder.
fn scenes(folder: &Path, found: &mut Vec<Vec<u8>>) {
    let mut paths: Vec<PathBuf> =
        std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()).collect();
    paths.sort();
    for path in paths {
        if path.is_dir() {
            scenes(&path, found);
        } else if path.extension().is_some_and(|e| e == "scn" || e == "pov" || e == "inc") {
            // Long ones take long; what is in them is in shorter ones too.
            found.extend(std::fs::read(&path).ok().filter(|text| text.len() < 30_000));
        }
    }
}

fn mutated(seeds: &[Vec<u8>], random: &mut Random) -> Vec<u8> {
    if random.below(20) == 0 {
        return (0..random.below(300)).map(|_| random.next() as u8).collect();
    }
    let mut text = seeds[random.below(seeds.len())].clone();
    for _ in 0..1 + random.below(8) {
        let range = random.range(text.len(), 200);
        match random.below(6) {
            0 => drop(text.splice(range, [])),
            1 => {
                let copy = text[range.clone()].to_vec();
                drop(text.splice(range.end..range.end, copy));
            }
            2 => {
                let copy = text[range].to_vec();
                let at = random.range(text.len(), 40);
                drop(text.splice(at, copy));
            }
            3 => {
                let other = &seeds[random.below(seeds.len())];
                let piece = other[random.range(other.len(), 1000)].to_vec();
                drop(text.splice(range, piece));
            }
            4 => {
                let at = random.below(text.len());
                if let Some(byte) = text.get_mut(at) {
                    *byte = random.next() as u8;
                }
            }
            _ => {
                let piece = PIECES[random.below(PIECES.len())];
                drop(text.splice(range.start..range.start, piece.bytes()));
            }
        }
    }
    text
}

/// Kilobytes that the process holds; 0 where the system does not say.
fn resident_kb() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    line.and_then(|line| line.split_whitespace().next()?.parse().ok()).unwrap_or(0)
}

fn keep(text: &[u8], what: &str) -> String {
    let path = std::env::temp_dir().join(format!("octray-fuzz-{what}-{}.scn", std::process::id()));
    let kept = std::fs::write(&path, text).is_ok();
    if kept { path.display().to_string() } else { format!("{text:?}") }
}

#[test]
fn no_text_breaks_the_front_end() {
    let number = |name: &str| std::env::var(name).ok().and_then(|text| text.parse::<u64>().ok());
    let seconds = number("OCTRAY_FUZZ_SECONDS");
    let budget = Duration::from_secs(seconds.unwrap_or(3));
    let mut seeds = Vec::new();
    scenes(Path::new("tests"), &mut seeds);
    if seconds.is_some() {
        scenes(Path::new("/usr/share/doc/povray/examples"), &mut seeds);
        scenes(Path::new("/usr/share/povray-3.7/include"), &mut seeds);
    }
    assert!(seeds.len() > 40, "only {} scenes to begin with", seeds.len());

    let options = Options {
        library_paths: vec!["/usr/share/povray-3.7/include".into()],
        allow_missing: true,
        limits: Limits { steps: 1_000_000, calls: 500, memory: 256 << 20, errors: 50 },
        ..Options::default()
    };
    let under_way: Mutex<Option<(Instant, Vec<u8>)>> = Mutex::new(None);
    let done = std::sync::atomic::AtomicBool::new(false);
    let mut random = Random(number("OCTRAY_FUZZ_SEED").unwrap_or(1));
    let begin = Instant::now();
    let mut count = 0u64;
    std::thread::scope(|scope| {
        // A hang cannot be stopped from inside: the watchman ends the process.
        scope.spawn(|| {
            while !done.load(std::sync::atomic::Ordering::Relaxed) {
                std::thread::sleep(Duration::from_millis(200));
                let late = under_way.lock().unwrap().take_if(|(since, _)| since.elapsed() > HANG);
                if let Some((_, text)) = late {
                    eprintln!("an input takes over {HANG:?}: {}", keep(&text, "hang"));
                    std::process::exit(101);
                }
            }
        });
        while begin.elapsed() < budget {
            let text = mutated(&seeds, &mut random);
            *under_way.lock().unwrap() = Some((Instant::now(), text.clone()));
            let readable = String::from_utf8_lossy(&text);
            let result = std::panic::catch_unwind(|| {
                let found = from_text("fuzz.scn", &readable, &options);
                // Every diagnostic can be shown, whatever it points at.
                for diagnostic in &found.diagnostics {
                    diagnostic.render(&found.sources, false);
                    diagnostic.json(&found.sources);
                }
            });
            *under_way.lock().unwrap() = None;
            count += 1;
            if result.is_err() || resident_kb() > MEMORY_KB {
                done.store(true, std::sync::atomic::Ordering::Relaxed);
                let what = if result.is_err() { "panic" } else { "memory" };
                panic!("input {count} ends in {what}: {}", keep(&text, what));
            }
        }
        done.store(true, std::sync::atomic::Ordering::Relaxed);
    });
    println!("{count} inputs from {} scenes", seeds.len());
    assert!(count > 10, "only {count} inputs in {budget:?}");
}
