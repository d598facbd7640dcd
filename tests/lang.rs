//! The scene language from the outside: text in, values and diagnostics out.

use octray::eval::{Options, Stream, from_text};
use octray::lang::Severity;
use octray::scene::{Gamma, Shape};

/// What the scene's `#debug` wrote; no diagnostic may come.
fn debug(text: &str) -> String {
    let done = from_text("test.scn", text, &Options::default());
    let told: Vec<_> = done.diagnostics.iter().map(|d| d.short(&done.sources)).collect();
    assert!(told.is_empty(), "{text}: {told:?}");
    done.stream(Stream::Debug)
}

/// The value of an expression, to 6 digits.
fn value(expression: &str) -> String {
    debug(&format!("#version 3.7; #declare V = {expression}; #debug str(V, 0, 6)"))
}

#[test]
fn expressions_have_their_values() {
    let table = [
        ("1 + 2 * 3", "7.000000"),
        ("-2 - -3", "1.000000"),
        ("(1 < 2) + (2 = 2 + 1e-11)", "2.000000"),
        ("(1 ? 2 : 3)", "2.000000"),
        ("mod(-7, 3)", "-1.000000"),
        ("int(-2.7)", "-2.000000"),
        ("log(1000)", "3.000000"),
        ("(<1, 2> + <1, 2, 3>).y", "4.000000"),
        ("vdot(2, <1, 2, 3>)", "12.000000"),
        ("vrotate(x, 90 * y).z", "-1.000000"),
        ("<1 -1 0>.x", "0.000000"),
        ("max(1, 5, 3)", "5.000000"),
    ];
    for (expression, expected) in table {
        assert_eq!(value(expression), expected, "{expression}");
    }
}

/// Every scene in `tests/lang` says by `#debug` what it said in POV-Ray 3.7 (recorded by `tests/lang/make.py`).
#[test]
fn values_are_those_of_pov_ray() {
    let mut count = 0;
    let mut wrong = Vec::new();
    let mut paths: Vec<_> =
        std::fs::read_dir("tests/lang").unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    for path in paths.iter().filter(|path| path.extension().is_some_and(|e| e == "scn")) {
        // Some ask for the extents of shapes that are not rendered.
        let done = octray::eval::load(path, &Options { list_missing: true, ..Options::default() });
        // POV-Ray warns too, of division by zero and the like.
        let errors = done.diagnostics.iter().filter(|d| d.severity == Severity::Error);
        let told: Vec<_> = errors.map(|d| d.short(&done.sources)).collect();
        let expected = std::fs::read_to_string(path.with_extension("out")).unwrap();
        let found = done.stream(Stream::Debug);
        if !told.is_empty() || found != expected {
            wrong.push(format!("{}: {told:?}\n found {found:?}\n expected {expected:?}", path.display()));
        }
        count += 1;
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(count >= 60, "only {count} scenes in tests/lang");
}

#[test]
fn macros_are_tokens_in_place_of_the_call() {
    assert_eq!(debug("#macro A() 1+2 #end #declare V = A()*3; #debug str(V, 0, 0)"), "7");
}

#[test]
fn parameters_are_references_to_bare_names() {
    let text = "#macro Set(P) #local P = 5; #end #declare A = 1; Set(A) #debug str(A, 0, 0)";
    assert_eq!(debug(text), "5");
}

#[test]
fn gamma_follows_the_version() {
    let gamma = |text: &str| from_text("test.scn", text, &Options::default()).scene.globals.assumed_gamma;
    assert_eq!(gamma(""), Gamma::Off);
    assert_eq!(gamma("#version 3.7;"), Gamma::Power(1.0));
    assert_eq!(gamma("#include \"colors.inc\""), Gamma::Power(1.0));
    assert_eq!(gamma("global_settings { assumed_gamma 2.2 }"), Gamma::Power(2.2));
}

#[test]
fn a_scene_becomes_objects() {
    let text = "#version 3.7; camera { location -5*z look_at 0 } light_source { 10, 1 }
        #declare Ball = sphere { 0, 1 pigment { rgb x } }
        #for (I, 0, 2) object { Ball translate I*x } #end";
    let done = from_text("test.scn", text, &Options::default());
    assert!(done.diagnostics.is_empty());
    assert_eq!(done.scene.objects.len(), 3);
    assert_eq!(done.scene.lights.len(), 1);
    assert!(matches!(done.scene.objects[2].shape, Shape::Sphere { radius: 1.0, .. }));
    assert_eq!(done.scene.objects[2].transform.point(glam::DVec3::ZERO).x, 2.0);
}

/// Measured in POV-Ray 3.7: a block adds to the interior that is there already, a name replaces it.
#[test]
fn interiors_add_up_unless_named() {
    let interior = |said: &str| {
        let text = format!(
            "#version 3.7; #declare Glass = sphere {{ 0, 1 interior {{ ior 1.3 fade_distance 3 }} }}
             #declare Amber = material {{ interior {{ ior 1.3 fade_distance 3 }} }}
             #declare Water = interior {{ ior 1.2 }} {said}"
        );
        let done = from_text("test.scn", &text, &Options::default());
        assert!(!done.has_errors(), "{said}");
        let interior = done.scene.objects[0].interior.clone().unwrap();
        (interior.ior, interior.fade_distance)
    };
    assert_eq!(interior("object { Glass interior { ior 1.05 } }"), (1.05, 3.0));
    assert_eq!(interior("sphere { 0, 1 material { Amber interior { ior 1.05 } } }"), (1.05, 3.0));
    assert_eq!(interior("object { Glass interior { Water } }"), (1.2, 0.0));
}

/// Measured in POV-Ray 3.7: the pictures are the same.
#[test]
fn a_name_in_a_texture_is_as_good_as_its_block() {
    let texture = |said: &str| {
        let text = format!(
            "#declare P = pigment {{ checker rgb x, rgb y scale 2 }} #declare F = finish {{ ambient 0.7 }}
             #declare T = texture {{ pigment {{ rgb z }} finish {{ phong 1 }} scale 3 }}
             sphere {{ 0, 1 {said} }}"
        );
        let done = from_text("test.scn", &text, &Options::default());
        let told: Vec<_> = done.diagnostics.iter().map(|d| d.short(&done.sources)).collect();
        assert!(told.is_empty(), "{said}: {told:?}");
        done.scene.objects[0].texture.clone().unwrap()
    };
    let pairs = [
        ("texture { P }", "texture { pigment { P } }"),
        ("texture { F P }", "texture { finish { F } pigment { P } }"),
        ("texture { P F P scale 2 }", "texture { pigment { P } finish { F } scale 2 }"),
        (
            "texture { P finish { F diffuse 0.2 } }",
            "texture { pigment { P } finish { ambient 0.7 diffuse 0.2 } }",
        ),
        ("texture { T P }", "texture { T pigment { P } }"),
        ("texture { P } texture { T }", "texture { pigment { P } } texture { T }"),
        ("material { texture { P } }", "texture { pigment { P } }"),
    ];
    for (name, block) in pairs {
        assert_eq!(texture(name), texture(block), "{name}");
    }
}

/// POV-Ray 3.7 reads the file that is there on the disk. Where none may be written the text is in memory.
#[test]
fn written_files_are_included_without_a_disk() {
    let text = "#macro Run(Text) #fopen F \"no_such_folder/a.tmp\" write #write (F, Text) #fclose F
        #include \"no_such_folder/a.tmp\" #end
        #declare A = Run(\"3\"); #declare B = Run(\"A + 1\"); #debug str(A*10 + B, 0, 0)";
    let done = from_text("test.scn", text, &Options::default());
    assert!(!done.has_errors());
    assert_eq!(done.stream(Stream::Debug), "34");
}

/// Wood has colours of its own, which are not modelled; a map given later makes up for that.
#[test]
fn a_map_given_later_is_enough() {
    let errors = |map: &str| {
        let text =
            format!("#declare P = pigment {{ wood turbulence 0.1 }} sphere {{ 0, 1 pigment {{ P {map} }} }}");
        from_text("test.scn", &text, &Options::default()).diagnostics.len()
    };
    assert_eq!((errors(""), errors("color_map { [0 rgb 0] [1 rgb 1] }")), (1, 0));
}

/// Without POV-Ray's includes there are octray's own, which evaluate, and whose names mean what POV-Ray's mean.
#[test]
fn embedded_includes_stand_in_for_pov_ray_s() {
    let text = |body: &str| {
        let names = ["colors", "consts", "finish", "functions", "glass", "math", "metals", "rand", "shapes"];
        let all = names.iter().chain(&["textures", "transforms"]);
        let includes: String = all.map(|name| format!("#include \"{name}.inc\"\n")).collect();
        format!("#version 3.7;\n{includes}{body}")
    };
    // What POV-Ray 3.7 says of the same with its own includes.
    let table = [
        ("str(sind(30), 0, 6)", "0.500000"),
        ("str(clamp(5.5, 1, 3), 0, 3)", "1.500"),
        ("str(clip(5.5, 1, 3), 0, 3)", "3.000"),
        ("str(even(4) + 10*odd(-3), 0, 0)", "11"),
        ("str(VAngleD(x, y), 0, 3)", "90.000"),
        ("str(VRotationD(x, y, z), 0, 3)", "90.000"),
        ("vstr(3, VProject_Plane(<1, 2, 3>, y), \" \", 0, 1)", "1.0 0.0 3.0"),
        ("vstr(3, vtransform(x, Axis_Rotate_Trans(y, 90)), \" \", 0, 1)", "0.0 0.0 -1.0"),
        ("vstr(3, vtransform(x, Reorient_Trans(x, y)), \" \", 0, 1)", "0.0 1.0 0.0"),
        (
            "vstr(3, max_extent(object { Round_Box(<-1, -1, -1>, <1, 1, 1>, 0.2, no) }), \" \", 0, 1)",
            "1.0 1.0 1.0",
        ),
        ("str(f_sphere(3, 4, 0, 1), 0, 1)", "4.0"),
        ("str(P_Copper3.green, 0, 2)", "0.30"),
    ];
    for (expression, expected) in table {
        assert_eq!(
            debug(&text(&format!("#debug {expression}"))).trim_start_matches('-'),
            expected,
            "{expression}"
        );
    }
    let placed = "sphere { 0, 1 texture { T_Chrome_2D } } sphere { 0, 1 pigment { Col_Glass_Ruby } finish { F_Glass4 } interior { I_Glass } }
        object { Wire_Box(<-1, -1, -1>, <1, 1, 1>, 0.1, no) } object { Round_Cylinder(0, y, 1, 0.1, no) } sphere { 0, 1 texture { Polished_Chrome } finish { Shiny } }";
    let done = from_text("test.scn", &text(placed), &Options::default());
    let told: Vec<_> = done.diagnostics.iter().map(|d| d.short(&done.sources)).collect();
    assert!(told.is_empty(), "{told:?}");
    assert_eq!(done.scene.objects.len(), 5);
}
