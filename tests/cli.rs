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
        for word in ["render", "check", "compare", "crosscheck", "Exit codes"] {
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
            "render ball.scn -o ball.gif",
            "render ball.scn -o ball.ppm --alpha",
            "render ball.scn -o ball.jpg --bit-depth 16",
            "render ball.scn --file-gamma 0",
            "render ball.scn -o - --stats -",
            "compare a.png b.png --gate 2",
        ] {
            let (code, message) = told(&octray(folder.path(), args));
            assert_eq!(code, 2, "`{args}`: {message}");
            assert!(!message.is_empty(), "`{args}`");
        }
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "a wrong command line makes no file");
    }
}

mod scenes_with_errors {
    use super::*;

    #[test]
    fn bad_scenes_are_exit_code_1_and_make_no_file() {
        let folder = folder();
        fs::write(folder.path().join("bad.scn"), "sphere { <0, 1, 0>, ").unwrap();
        fs::create_dir(folder.path().join("dir.scn")).unwrap();
        for scene in ["bad.scn", "dir.scn", "absent.scn"] {
            for command in [format!("check {scene}"), format!("render {scene} -o out.png")] {
                let (code, message) = told(&octray(folder.path(), &command));
                assert_eq!(code, 1, "{command}: {message}");
                assert!(message.contains("error"), "{command}: {message}");
            }
        }
        assert!(!folder.path().join("out.png").exists());
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
