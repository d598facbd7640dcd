//! The built program, from outside: exit codes, messages, files.

use octray::film::{Film, Pixel};
use octray::image_io::{self, Assume, Encoding, Format};
use octray::transfer::Transfer;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

/// Runs `octray` with arguments split at spaces, in `folder`.
fn octray(folder: &Path, args: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_octray"));
    command.current_dir(folder).args(args.split_whitespace()).output().expect("the program starts")
}

/// Exit code and what was said on the standard error stream.
fn told(output: &Output) -> (i32, String) {
    (output.status.code().expect("not killed"), String::from_utf8_lossy(&output.stderr).into_owned())
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

const BALL: &str = "#version 3.7; global_settings { assumed_gamma 1 }
camera { location -5*z look_at 0 }
light_source { <3, 5, -6>, rgb 1 }
sphere { 0, 1 pigment { rgb <0.9, 0.4, 0.2> } }
";

fn grey(value: f32) -> Film {
    Film { width: 8, height: 4, pixels: vec![Pixel { rgb: [value; 3], transmit: 0.0 }; 32] }
}

fn linear_png(path: &Path, film: &Film) {
    let encoding = Encoding { deep: true, transfer: Transfer::LINEAR, ..Encoding::default() };
    image_io::write(path, film, &encoding).unwrap();
}

mod help_and_usage {
    use super::*;

    #[test]
    fn help_names_every_command_and_long_options() {
        let folder = folder();
        let help = said(&octray(folder.path(), "--help"));
        for word in ["render", "check", "compare", "bench", "crosscheck", "rays", "Exit codes"] {
            assert!(help.contains(word), "{word} is not in\n{help}");
        }
        let help = said(&octray(folder.path(), "render --help"));
        let options = "--output --width --height --threads --precision --engine --library-path --declare --clock --stats --quiet \
             --bit-depth --alpha --file-gamma";
        for word in options.split_whitespace() {
            assert!(help.contains(word), "{word} is not in\n{help}");
        }
    }

    #[test]
    fn a_wrong_command_line_is_exit_code_2() {
        let folder = folder();
        fs::write(folder.path().join("ball.scn"), BALL).unwrap();
        for args in [
            "",
            "paint",
            "render",
            "render ball.scn -W 0",
            "render ball.scn -p sloppy",
            "render ball.scn -D 1x=2",
            "render ball.scn -D sphere=2",
            "render ball.scn -D clock=2",
            "render ball.scn -W 100000 -H 100000",
            "crosscheck ball.scn -t 2",
            "rays ball.scn --fov 30",
            "rays ball.scn --eye 0,0,-5 --fov 180",
            "rays ball.scn --eye 0,0,-5 --fov nan",
            "rays ball.scn --explain 3",
            "rays ball.scn --rays ball.rays --sets camera",
            "render ball.scn -o ball.gif",
            "render ball.scn -o ball.ppm --alpha",
            "render ball.scn -o ball.jpg --bit-depth 16",
            "render ball.scn --file-gamma 0",
            "render ball.scn -o - --stats -",
            "render ball.scn -t 5000",
            "bench ball.scn -t 5000",
            "crosscheck ball.scn -t 5000",
            "rays ball.scn -t -1",
            "render ball.scn -o ball.scn --format png",
            "render ball.scn -o ./ball.scn --format png",
            "render ball.scn --stats ball.scn",
            "render ball.scn -o a.png --stats ./a.png",
            "render ball.scn --stats ball.png",
            "render ball.scn -o out.jpg -W 65536 -H 1",
            "render ball.scn -o - --format jpg -W 1 -H 65536",
            "compare a.png b.png --gate 2",
            "compare a.png b.png --strip c.exr",
            "compare a.png b.png --strip c.png --amplify nan",
            "render ball.scn --clock inf",
            "bench ball.scn --oracle-limit nan",
            "compare ball.scn b.png --strip ball.scn",
            "compare a.png ball.scn --strip ./ball.scn",
        ] {
            let (code, message) = told(&octray(folder.path(), args));
            assert_eq!(code, 2, "`{args}`: {message}");
            assert!(!message.is_empty(), "`{args}`");
        }
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "a wrong command line makes no file");
    }
}

mod scenes_too_large {
    use super::*;
    use std::time::{Duration, Instant};

    /// Shared parts are looked at once, not once for each of the 2^40 ways to them.
    const SOON: Duration = Duration::from_secs(20);

    fn check(first: &str, turn: &str) {
        let folder = folder();
        let scene =
            format!("#version 3.7;\n#declare A = {first}\n{}object {{ A }}", format!("{turn}\n").repeat(40));
        fs::write(folder.path().join("large.scn"), scene).unwrap();
        let begin = Instant::now();
        let checked = octray(folder.path(), "check large.scn");
        let (code, message) = told(&checked);
        assert_eq!(code, 0, "{first}: {message}");
        assert!(
            said(&checked).contains("refused: ") && said(&checked).contains("--max-shapes"),
            "{}",
            said(&checked)
        );
        for engine in ["packets", "reference"] {
            let (code, message) =
                told(&octray(folder.path(), &format!("render large.scn -q --engine {engine}")));
            assert_eq!(code, 1, "{first}: {message}");
            assert!(message.contains("shapes") && message.contains("--max-shapes"), "{message}");
        }
        assert!(!folder.path().join("large.png").exists());
        assert!(begin.elapsed() < SOON, "{first}: {:?}", begin.elapsed());
    }

    #[test]
    fn doubled_objects_are_counted_and_refused() {
        let twice = "#declare A = union { object { A } object { A translate x } }";
        check("sphere { 0, 1 }", twice);
        check("sphere { 0, 1 pigment { rgbt 1 } interior { ior 1.5 } }", twice);
        check("difference { sphere { 0, 1 } box { 0, 1 } cutaway_textures }", twice);
        check("smooth_triangle { 0, x + y, x, y, z, y }", twice);
        check("mesh { triangle { 0, x, y } }", twice);
        check("sphere { 0, 1 }", "#declare A = sphere { 0, 1 clipped_by { object { A } object { A } } }");
        check(
            "sphere { 0, 1 }",
            "#declare A = intersection { object { A pigment { rgb x } } object { A } scale 2 }",
        );
    }

    #[test]
    fn the_limit_can_be_raised_and_lowered() {
        let folder = folder();
        fs::write(folder.path().join("ball.scn"), BALL.repeat(3)).unwrap();
        for (limit, expected) in [(2, 1), (3, 0)] {
            let (code, message) =
                told(&octray(folder.path(), &format!("render ball.scn -W 8 -H 6 --max-shapes {limit}")));
            assert_eq!(code, expected, "{message}");
        }
    }

    /// A mesh of 2,000 triangles in a hundred places is kept once, unless it is cut.
    #[test]
    fn a_mesh_counts_once_however_often_it_is_placed() {
        let folder = folder();
        let mesh = "#declare M = mesh { #declare I = 0; #while (I < 2000) \
            triangle { <I, 0, 0>, <I + 1, 0, 0>, <I, 1, 0> } #declare I = I + 1; #end }";
        let places =
            "#declare I = 0; #while (I < 100) object { M translate I*z LOOK } #declare I = I + 1; #end";
        for (look, limit, expected) in [
            ("", 2100, 0),
            ("", 2099, 1),
            ("pigment { rgbt 0.5 }", 2100, 0),
            ("clipped_by { plane { x, 9 } }", 150_000, 1),
        ] {
            let text = format!("#version 3.7;\n{mesh}\n{}", places.replace("LOOK", look));
            fs::write(folder.path().join("mesh.scn"), text).unwrap();
            let render = format!("render mesh.scn -W 8 -H 6 --max-shapes {limit}");
            let (code, message) = told(&octray(folder.path(), &render));
            assert_eq!(code, expected, "{look} {limit}: {message}");
        }
    }
}

mod scenes_with_errors {
    use super::*;

    #[test]
    fn diagnostics_have_a_form_for_programs() {
        let folder = folder();
        fs::write(folder.path().join("bad.scn"), "#macro M()\n  Sphere { 0, 1 }\n#end\nM()\n").unwrap();
        let (code, message) = told(&octray(folder.path(), "check bad.scn --message-format short"));
        assert_eq!(code, 1);
        let first = message.lines().next().unwrap();
        assert!(first.starts_with("bad.scn:2:3: error: ") && first.contains("`Sphere`"), "{message}");
        let (code, message) = told(&octray(folder.path(), "render bad.scn --message-format json"));
        assert_eq!(code, 1);
        let first: serde_json::Value = serde_json::from_str(message.lines().next().unwrap()).unwrap();
        assert_eq!((&first["severity"], &first["place"]["column"]), (&"error".into(), &3.into()));
        assert_eq!(first["help"], "there is `sphere`");
        assert_eq!(first["notes"][0]["place"]["line"], 4);
    }

    #[test]
    fn bad_scenes_are_exit_code_1_and_make_no_file() {
        let folder = folder();
        fs::write(folder.path().join("bad.scn"), "sphere { <0, 1, 0>, ").unwrap();
        fs::create_dir(folder.path().join("dir.scn")).unwrap();
        for scene in ["bad.scn", "dir.scn", "absent.scn"] {
            for command in [format!("check {scene}"), format!("render {scene} -o out.png")] {
                let (code, message) = told(&octray(folder.path(), &command));
                assert_eq!(code, 1, "{command}: {message}");
                assert!(message.contains("error") && message.contains(scene), "{command}: {message}");
            }
        }
        assert!(!folder.path().join("out.png").exists());
    }
}

mod files_without_end {
    use super::*;

    #[cfg(target_os = "linux")]
    #[test]
    fn a_device_is_told() {
        let (code, message) = told(&octray(folder().path(), "check /dev/zero"));
        assert!(code == 1 && message.contains("/dev/zero: it is longer than 1024 MB"), "{message}");
    }

    #[test]
    fn what_is_too_long_is_told() {
        let folder = folder();
        // Of holes: these take no room on the disk.
        let long = fs::File::create(folder.path().join("long.inc")).unwrap();
        long.set_len(5 << 30).unwrap();
        fs::write(folder.path().join("a.scn"), "#include \"long.inc\"").unwrap();
        fs::write(folder.path().join("b.scn"), "#fopen F \"long.inc\" read").unwrap();
        // As if it were empty, it would be written anew.
        fs::write(folder.path().join("c.scn"), "#fopen F \"long.inc\" append #write (F, 1)").unwrap();
        for (args, expected, says) in [
            ("check long.inc", 1, "longer than 1024 MB"),
            ("check a.scn", 1, "longer than 1024 MB"),
            ("check b.scn", 1, "longer than 1024 MB"),
            ("check c.scn --allow-write .", 1, "longer than 1024 MB"),
            ("rays --mesh long.inc --eye 1,2,3", 3, "longer than 4096 MB"),
            ("compare long.inc long.inc", 3, "longer than 4096 MB"),
        ] {
            let (code, message) = told(&octray(folder.path(), args));
            assert!(code == expected && message.contains(says), "{args}: {code}: {message}");
        }
        assert_eq!(long.metadata().unwrap().len(), 5 << 30);
    }
}

mod pictures {
    use super::*;

    /// A folder with the ball in it.
    fn with_ball() -> tempfile::TempDir {
        let folder = folder();
        fs::write(folder.path().join("ball.scn"), BALL).unwrap();
        folder
    }

    #[test]
    fn the_default_is_povrays_size_and_the_scenes_name() {
        let folder = with_ball();
        let output = octray(folder.path(), "render ball.scn");
        // In a pipe nothing is said.
        assert_eq!(told(&output), (0, String::new()));
        let film = image_io::read(&folder.path().join("ball.png"), Assume::File).unwrap();
        assert_eq!((film.width, film.height), (160, 120));
        // The ball in the middle, nothing in the corner.
        assert!(film.pixel(80, 60).rgb[0] > 0.2 && film.pixel(0, 0).rgb == [0.0; 3]);
    }

    #[test]
    fn what_a_scene_reads_is_not_written_over() {
        let folder = folder();
        let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
        write("size.inc", "#declare R = 1;");
        write("data.ppm", "1, 2");
        let reads = "#include \"size.inc\" #fopen F \"data.ppm\" read #read (F, A) sphere { 0, R*A pigment { rgb 1 } }";
        write("ball.scn", &format!("#version 3.7; global_settings {{ assumed_gamma 1 }} {reads}"));
        for (args, name) in [
            ("-o size.inc --format png", "size.inc"),
            ("-o ./data.ppm", "./data.ppm"),
            ("-o new.png --stats size.inc", "size.inc"),
        ] {
            let before = fs::read(folder.path().join(name)).unwrap();
            let (code, message) = told(&octray(folder.path(), &format!("render ball.scn {args}")));
            let overwritten = format!("would overwrite the file that the scene reads: {name}");
            assert!(code == 2 && message.contains(&overwritten), "{args}: {code} {message}");
            assert_eq!(fs::read(folder.path().join(name)).unwrap(), before, "{args}");
        }
        assert_eq!(told(&octray(folder.path(), "render ball.scn -o new.png")).0, 0);
    }

    #[test]
    fn every_format_holds_the_same_picture() {
        let folder = with_ball();
        assert_eq!(told(&octray(folder.path(), "render ball.scn -W 40 -H 30 -o exact.exr")).0, 0);
        for (name, options, allowed) in [
            // Half a step of code: 1/65535 linear, 1/255 on the curve's steepest part in use, 1/128 of the largest channel,
            // and for JPEG what it makes of the ball's edge.
            ("a.png", "--bit-depth 16 --file-gamma 1.0", 8e-6),
            ("b.ppm", "--bit-depth 16", 2e-5),
            ("c.png", "", 4.6e-3),
            ("d.ppm", "", 4.6e-3),
            ("e.hdr", "", 8e-3),
            ("f.jpg", "", 0.2),
            ("g.picture", "--format png", 4.6e-3),
        ] {
            let (code, message) =
                told(&octray(folder.path(), &format!("render ball.scn -W 40 -H 30 -o {name} {options}")));
            assert_eq!(code, 0, "{name}: {message}");
            let output = octray(folder.path(), &format!("compare exact.exr {name} --json"));
            let figures: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
            assert!(figures["all"]["max"].as_f64().unwrap() <= allowed, "{name}: {figures}");
        }
    }

    #[test]
    fn a_dash_is_the_standard_output() {
        let folder = with_ball();
        let output = octray(folder.path(), "render ball.scn -W 8 -H 6 -o - --bit-depth 16");
        octray(folder.path(), "render ball.scn -W 8 -H 6 -o file.png --bit-depth 16");
        assert_eq!(output.stdout, fs::read(folder.path().join("file.png")).unwrap());
        let output = octray(folder.path(), "render ball.scn -W 8 -H 6 -o - --format ppm");
        assert!(output.stdout.starts_with(b"P6\n8 6\n255\n") && output.stdout.len() == 11 + 8 * 6 * 3);
    }

    #[test]
    fn threads_do_not_change_the_bytes() {
        let folder = with_ball();
        let with = |threads: u32| {
            octray(folder.path(), &format!("render ball.scn -t {threads} -o - --format exr")).stdout
        };
        let one = with(1);
        assert!(one.len() > 1000 && one == with(2) && one == with(3));
    }

    #[test]
    fn alpha_is_written_when_asked_for() {
        let folder = with_ball();
        octray(folder.path(), "render ball.scn --alpha -o a.png");
        octray(folder.path(), "render ball.scn -o b.png");
        let read = |name: &str| image_io::read(&folder.path().join(name), Assume::File).unwrap();
        assert_eq!((read("a.png").pixel(0, 0).transmit, read("a.png").pixel(80, 60).transmit), (1.0, 0.0));
        assert_eq!(read("b.png").pixel(0, 0).transmit, 0.0);
    }

    #[test]
    fn stats_have_exactly_their_keys() {
        let folder = with_ball();
        assert_eq!(told(&octray(folder.path(), "render ball.scn -t 1 -p fast -o a.png --stats s.json")).0, 0);
        let text = fs::read_to_string(folder.path().join("s.json")).unwrap();
        let stats: serde_json::Value = serde_json::from_str(&text).unwrap();
        let keys = |value: &serde_json::Value| {
            let mut keys: Vec<_> = value.as_object().unwrap().keys().cloned().collect();
            keys.sort();
            keys.join(" ")
        };
        assert_eq!(
            keys(&stats),
            "build_s height mrays_per_s parse_s peak_rss_bytes precision queues rays shapes threads total_s trace_s width"
        );
        assert_eq!(keys(&stats["rays"]), "camera reflect refract shadow");
        assert_eq!(stats["rays"]["camera"], 160 * 120);
        // 160 by 120 pixels are whole packets; a ball alone has no mirror rays.
        assert_eq!(keys(&stats["queues"]), "camera hits reflect refract shadow shadow_answered");
        assert_eq!((&stats["queues"]["camera"], &stats["queues"]["reflect"]), (&8.0.into(), &().into()));
        assert_eq!((&stats["threads"], &stats["precision"]), (&1.into(), &"fast".into()));
        assert_eq!(stats["shapes"], serde_json::json!({ "sphere": 1 }));
        assert!(stats["total_s"].as_f64().unwrap() >= stats["trace_s"].as_f64().unwrap());
    }

    #[test]
    fn bench_tells_the_lanes_of_each_mode() {
        let folder = with_ball();
        let args = "bench ball.scn --report r --rounds 1 -W 32 -H 24 --povray no-such-program";
        assert_eq!(told(&octray(folder.path(), args)).0, 0);
        let read = |name: &str| fs::read_to_string(folder.path().join("r").join(name)).unwrap();
        let figures: serde_json::Value = serde_json::from_str(&read("figures.json")).unwrap();
        let modes = figures["scenes"][0]["modes"].as_array().unwrap();
        assert_eq!(modes.len(), 5);
        for mode in modes {
            let lanes = mode["occupancy"]["leaf"].as_f64();
            if mode["name"] == "oracle" {
                assert_eq!((lanes, &mode["queues"]), (None, &().into()));
                continue;
            }
            // Some lane works in every test.
            assert!(lanes.is_some_and(|lanes| (1.0..=8.0).contains(&lanes)), "{mode}");
            // 32 by 24 pixels are whole packets.
            assert_eq!(mode["queues"]["camera"], 8.0, "{mode}");
        }
        // All camera queues, and tests of the ball by rays that its pixels send.
        let full = |means: &serde_json::Value| {
            let means = means.as_object().into_iter().flat_map(|means| means.values());
            means.filter(|mean| mean.as_f64().is_some_and(|mean| format!("{mean:.2}") == "8.00")).count()
        };
        let expected =
            modes.iter().map(|mode| full(&mode["occupancy"]) + full(&mode["queues"])).sum::<usize>();
        assert!(expected >= 4);
        assert_eq!(read("index.html").matches("<td>8.00</td>").count(), expected);
        let table = read("figures.csv");
        let columns = |line: &str| line.split(',').count();
        let head = table.lines().next().unwrap();
        assert!(head.contains(",povray_rmse,") && head.contains(",lanes_leaf,"), "{table}");
        assert!(table.lines().all(|line| columns(line) == columns(head)), "{table}");
    }

    #[test]
    fn limits_of_scripts_are_set_from_outside() {
        let folder = folder();
        let endless = "#declare A = 0; #while (1) #declare A = A + 1; #end";
        let hungry = "#declare S = \"0123456789abcdef\"; #while (1) #declare S = concat(S, S); #end";
        let deep = "#macro M(N) M(N + 1) #end M(0)";
        for (text, limit, said) in [
            (deep, "--max-call-depth 100", "more than 100 macro calls"),
            (endless, "--max-evaluation-steps 1000", "1000 evaluation steps"),
            (hungry, "--max-memory 1", "1 MB"),
        ] {
            fs::write(folder.path().join("long.scn"), text).unwrap();
            let (code, message) = told(&octray(folder.path(), &format!("check long.scn {limit}")));
            assert_eq!(code, 1, "{message}");
            assert!(message.contains(said), "{message}");
        }
    }

    #[test]
    fn what_cannot_be_written_is_exit_code_3_and_told_before_rendering() {
        let folder = with_ball();
        fs::create_dir(folder.path().join("dir.png")).unwrap();
        fs::write(folder.path().join("file"), "").unwrap();
        for out in ["nowhere/out.png", "dir.png", "file/out.png"] {
            // Rendering this would take days.
            let (code, message) =
                told(&octray(folder.path(), &format!("render ball.scn -o {out} -W 30000 -H 30000")));
            assert_eq!(code, 3, "{out}: {message}");
            assert!(message.contains(out), "{out}: {message}");
            assert!(!message.contains(".octray-"), "{out}: the temporary file's name is told: {message}");
        }
        // One device may take both.
        let both = "render ball.scn -W 8 -H 8 -o /dev/null --format png --stats /dev/null";
        assert!(!cfg!(unix) || told(&octray(folder.path(), both)).0 == 0);
        let (code, message) = told(&octray(folder.path(), "render ball.scn -o a.png --stats nowhere/s.json"));
        assert!(code == 3 && message.contains("nowhere/s.json"), "{message}");
    }

    #[test]
    fn a_failed_render_leaves_the_old_file() {
        let folder = with_ball();
        let old = folder.path().join("out.jpg");
        fs::write(&old, "old").unwrap();
        fs::write(folder.path().join("bad.scn"), "sphere {").unwrap();
        assert_eq!(told(&octray(folder.path(), "render bad.scn -o out.jpg")).0, 1);
        // A JPEG's side ends at 65535.
        let (code, message) = told(&octray(folder.path(), "render ball.scn -o out.jpg -W 70000 -H 1"));
        assert!(code == 2 && message.contains("65535"), "{message}");
        assert_eq!(fs::read(&old).unwrap(), b"old");
        let names = |entry: std::io::Result<fs::DirEntry>| entry.unwrap().file_name().into_string().unwrap();
        let mut left: Vec<_> = fs::read_dir(folder.path()).unwrap().map(names).collect();
        left.sort();
        assert_eq!(left, ["bad.scn", "ball.scn", "out.jpg"], "nothing temporary is left");
    }

    #[cfg(unix)]
    #[test]
    fn an_interrupted_render_leaves_the_old_file() {
        let folder = with_ball();
        let old = folder.path().join("out.png");
        fs::write(&old, "old").unwrap();
        let mut child = Command::new(env!("CARGO_BIN_EXE_octray"))
            .current_dir(folder.path())
            .args("render ball.scn -o out.png -W 20000 -H 20000 --engine reference".split(' '))
            .spawn()
            .unwrap();
        std::thread::sleep(std::time::Duration::from_millis(300));
        child.kill().unwrap();
        assert!(!child.wait().unwrap().success());
        assert_eq!(fs::read(&old).unwrap(), b"old");
    }

    #[test]
    fn what_the_scene_is_told_from_outside_arrives() {
        let folder = folder();
        let text = "#version 3.7; global_settings { assumed_gamma 1 } light_source { 9*y rgb 1 }
            camera { location -5*z look_at 0 } #include \"part.inc\"
            #if (clock = -2 & Big = 3) sphere { 0, Big pigment { rgb 1 } finish { ambient 1 diffuse 0 } } #end";
        fs::write(folder.path().join("told.scn"), text).unwrap();
        fs::create_dir(folder.path().join("library")).unwrap();
        fs::write(folder.path().join("library/part.inc"), "// nothing").unwrap();
        let args = "render told.scn -L library -D Big=3 --clock -2 -W 8 -H 6 -o out.png";
        assert_eq!(told(&octray(folder.path(), args)), (0, String::new()));
        let film = image_io::read(&folder.path().join("out.png"), Assume::File).unwrap();
        assert!(film.pixel(4, 3).rgb[0] > 0.9);
        assert_eq!(
            told(&octray(folder.path(), "render told.scn -o out.png")).0,
            1,
            "without -L the include is missing"
        );
    }
}

mod compare {
    use super::*;

    #[test]
    fn known_pictures_give_known_figures() {
        let folder = folder();
        let (a, b) = (folder.path().join("a.png"), folder.path().join("b.png"));
        let mut other = grey(0.5);
        other.pixels[11].rgb[2] = 0.75;
        linear_png(&a, &grey(0.5));
        linear_png(&b, &other);
        let output = octray(folder.path(), "compare a.png b.png --json --strip strip.png");
        let figures: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        // 16-bit steps of linear light.
        let close = |found: &serde_json::Value, value: f64| (found.as_f64().unwrap() - value).abs() < 2e-5;
        let all = &figures["all"];
        assert!(close(&all["max"], 0.25) && close(&all["rmse"], (0.0625f64 / 96.0).sqrt()), "{figures}");
        assert!(close(&all["over_1_255"], 1.0 / 32.0) && close(&all["within"], 31.0 / 32.0), "{figures}");
        assert_eq!((&all["worst"]["x"], &all["worst"]["y"]), (&3.into(), &1.into()));
        let strip = image_io::read(&folder.path().join("strip.png"), Assume::File).unwrap();
        assert_eq!((strip.width, strip.height), (28, 4));
        // The difference, .25 times 20, is beyond white.
        assert_eq!(strip.pixel(8 + 2 + 3, 1).rgb, [0.0, 0.0, 1.0]);
    }

    #[test]
    fn the_gate_decides_the_exit_code() {
        let folder = folder();
        let mut other = grey(0.5);
        other.pixels[11].rgb[2] = 0.75;
        linear_png(&folder.path().join("a.png"), &grey(0.5));
        linear_png(&folder.path().join("b.png"), &other);
        for (args, code) in [("", 0), ("--gate 0.96", 0), ("--gate 0.97", 1)] {
            assert_eq!(
                told(&octray(folder.path(), &format!("compare a.png b.png {args}"))).0,
                code,
                "{args}"
            );
        }
    }

    #[test]
    fn formats_of_one_picture_agree() {
        let folder = folder();
        linear_png(&folder.path().join("a.png"), &grey(0.5));
        for (name, format) in
            [("b.exr", Format::Exr), ("b.hdr", Format::Hdr), ("b.ppm", Format::Ppm), ("b.jpg", Format::Jpeg)]
        {
            image_io::write(
                &folder.path().join(name),
                &grey(0.5),
                &Encoding { format, ..Encoding::default() },
            )
            .unwrap();
            // 8-bit sRGB has steps of 7e-3 at middle grey, so .5 lies within half of that.
            let output = octray(folder.path(), &format!("compare a.png {name} --json"));
            let figures: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
            assert!(figures["all"]["max"].as_f64().unwrap() < 3.5e-3, "{name}: {figures}");
        }
    }

    #[test]
    fn what_cannot_be_compared_is_told() {
        let folder = folder();
        linear_png(&folder.path().join("a.png"), &grey(0.5));
        linear_png(&folder.path().join("b.png"), &Film::new(3, 3));
        fs::write(folder.path().join("c.png"), "not a picture").unwrap();
        for (args, code, word) in [
            ("compare a.png b.png", 1, "8 by 4 and 3 by 3"),
            ("compare a.png c.png", 3, "c.png"),
            ("compare a.png absent.png", 3, "absent.png"),
            ("compare a.png a.png --strip nowhere/strip.png", 3, "nowhere/strip.png"),
        ] {
            let (found, message) = told(&octray(folder.path(), args));
            assert_eq!(found, code, "{args}: {message}");
            assert!(message.contains(word), "{args}: {message}");
        }
    }
}

mod check_lists_what_is_missing {
    use super::*;

    #[test]
    fn check_accepts_what_render_refuses() {
        let folder = folder();
        let text = format!("{BALL} blob {{ threshold 1 }} blob {{ threshold 1 photons {{ target }} }}");
        fs::write(folder.path().join("blobs.scn"), text).unwrap();
        let check = octray(folder.path(), "check blobs.scn");
        assert_eq!(told(&check), (0, String::new()));
        let lines = said(&check);
        assert!(lines.contains("refused: blob (2 places, the first at blobs.scn:5:2)"), "{lines}");
        assert!(lines.contains("ignored: photons of an object (at blobs.scn:5:"), "{lines}");
        let (code, message) = told(&octray(folder.path(), "render blobs.scn -o out.png"));
        assert!(
            code != 0 && message.contains("not modelled yet: `blob` (2 places, the first here)"),
            "{message}"
        );
        assert_eq!(told(&octray(folder.path(), "render blobs.scn -o out.png -q --allow-missing")).0, 0);
    }

    #[test]
    fn scripts_write_only_where_they_may() {
        let folder = folder();
        let text = "#fopen F \"out.txt\" write #write (F, 1.5, \"\\n\") #fclose F";
        fs::write(folder.path().join("writer.scn"), text).unwrap();
        let check = octray(folder.path(), "check writer.scn");
        assert_eq!(told(&check).0, 0);
        assert!(said(&check).contains("ignored: #write to a file"));
        assert!(!folder.path().join("out.txt").exists());
        assert_eq!(told(&octray(folder.path(), "check writer.scn --allow-write .")).0, 0);
        assert_eq!(fs::read_to_string(folder.path().join("out.txt")).unwrap(), "1.5\n");
        // Not where a link leads out of there, nor over what is meant to stay.
        let out = folder.path().join("out.txt");
        fs::write(&out, "kept").unwrap();
        #[cfg(unix)]
        {
            fs::create_dir(folder.path().join("inner")).unwrap();
            std::os::unix::fs::symlink(&out, folder.path().join("inner/out.txt")).unwrap();
            fs::copy(folder.path().join("writer.scn"), folder.path().join("inner/writer.scn")).unwrap();
            let check = octray(folder.path(), "check inner/writer.scn --allow-write inner");
            assert!(said(&check).contains("ignored: #write to a file"));
        }
        let mut permissions = fs::metadata(&out).unwrap().permissions();
        permissions.set_readonly(true);
        fs::set_permissions(&out, permissions).unwrap();
        let (code, message) = told(&octray(folder.path(), "check writer.scn --allow-write ."));
        assert!(code == 1 && message.contains("the file is read-only"), "{code}: {message}");
        assert_eq!(fs::read_to_string(&out).unwrap(), "kept");
    }
}

#[cfg(unix)]
mod outputs_that_end {
    use super::*;
    use std::process::Stdio;

    fn written_to(folder: &Path, args: &str, out: impl Into<Stdio>) -> (i32, String) {
        let mut command = Command::new(env!("CARGO_BIN_EXE_octray"));
        command.current_dir(folder).args(args.split_whitespace()).stdout(out).stderr(Stdio::piped());
        told(&command.spawn().unwrap().wait_with_output().unwrap())
    }

    /// `println!` panicked, and files that were to be written after it were not.
    #[test]
    fn nobody_reading_is_no_failure() {
        let folder = folder();
        fs::write(folder.path().join("ball.scn"), BALL).unwrap();
        linear_png(&folder.path().join("a.png"), &grey(0.5));
        for args in [
            "check ball.scn",
            "compare a.png a.png",
            "compare a.png a.png --json",
            "rays ball.scn --size 8 --hits ball.hits",
            "bench ball.scn --rounds 1 -W 8 -H 8 --povray no-such-program --report r",
            "render ball.scn -W 8 -H 8 -o -",
            "render ball.scn -W 8 -H 8 -o a.png --stats -",
        ] {
            let (reader, writer) = std::io::pipe().unwrap();
            drop(reader);
            assert_eq!(written_to(folder.path(), args, writer), (0, String::new()), "{args}");
        }
        assert!(folder.path().join("ball.hits").exists() && folder.path().join("r/index.html").exists());
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_device_is_exit_code_3() {
        let folder = folder();
        fs::write(folder.path().join("ball.scn"), BALL).unwrap();
        linear_png(&folder.path().join("a.png"), &grey(0.5));
        let full = || fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        for args in [
            "check ball.scn",
            "compare a.png a.png",
            "rays ball.scn --size 8",
            "bench ball.scn --rounds 1 -W 8 -H 8 --povray no-such-program",
            "render ball.scn -W 8 -H 8 -o -",
        ] {
            let (code, message) = written_to(folder.path(), args, full());
            assert_eq!(code, 3, "{args}: {message}");
            assert!(message.contains("cannot write to standard output: "), "{args}: {message}");
        }
        // Nor does a full error stream matter.
        fs::write(folder.path().join("bad.scn"), "#debug \"told\" Sphere").unwrap();
        for (args, code) in [("check bad.scn", 1), ("crosscheck bad.scn --povray ./no-such-program", 3)] {
            let mut command = Command::new(env!("CARGO_BIN_EXE_octray"));
            let status = command.current_dir(folder.path()).args(args.split(' ')).stderr(full()).status();
            assert_eq!(status.unwrap().code(), Some(code), "{args}");
        }
    }
}

mod crosscheck {
    use super::*;

    #[test]
    fn an_absent_povray_is_exit_code_3() {
        let folder = folder();
        fs::write(folder.path().join("ball.scn"), BALL).unwrap();
        let (code, message) = told(&octray(folder.path(), "crosscheck ball.scn --povray ./no-such-program"));
        assert_eq!(code, 3);
        assert!(
            message.contains("no-such-program") && message.contains("apt-get install povray"),
            "{message}"
        );
    }

    #[test]
    fn an_empty_folder_is_told() {
        let folder = folder();
        let (code, message) = told(&octray(folder.path(), "crosscheck ."));
        assert_eq!(code, 2, "{message}");
    }
}

/// A CPU of 2008 (emulated, where QEMU is installed) gets advice, not an illegal instruction.
#[cfg(all(target_arch = "x86_64", target_feature = "avx2"))]
#[test]
fn a_cpu_that_is_too_old_is_told_so() {
    let mut command = Command::new("qemu-x86_64");
    let run = command.args(["-cpu", "Nehalem", env!("CARGO_BIN_EXE_octray"), "--version"]).output();
    let Ok(output) = run else {
        eprintln!("qemu-x86_64 is not installed: not tried");
        return;
    };
    let (code, message) = told(&output);
    assert!(
        message.contains("this CPU has no AVX, FMA") && message.contains("target-cpu=native"),
        "{message}"
    );
    assert_eq!((code, said(&output).as_str()), (3, ""));
}
