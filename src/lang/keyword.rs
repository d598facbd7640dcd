//! The words of the language. They cannot be declared (manual section 3.1.2).

macro_rules! keywords {
    ($($variant:ident $text:literal)*) => {
        /// A word that means something to POV-Ray 3.7, whether octray models it or not.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        #[allow(missing_docs, reason = "a variant is the word")]
        pub enum Keyword { $($variant,)* }

        impl Keyword {
            /// Every word.
            pub const ALL: &'static [Keyword] = &[$(Keyword::$variant,)*];

            /// As it is written.
            pub const fn text(self) -> &'static str {
                match self { $(Keyword::$variant => $text,)* }
            }
        }
    };
}

/// More than twice as many as there are words.
const SLOTS: usize = 1024;

/// A word's number plus one stands where its hash says, or in the next free place behind; 0 is free. Made when octray is compiled:
/// a small scene is read in less time than a map of all words is filled.
static BY_TEXT: [u16; SLOTS] = {
    assert!(2 * Keyword::ALL.len() <= SLOTS);
    let mut slots = [0; SLOTS];
    let mut word = 0;
    while word < Keyword::ALL.len() {
        let mut at = hash(Keyword::ALL[word].text().as_bytes());
        while slots[at] != 0 {
            at = (at + 1) % SLOTS;
        }
        word += 1;
        slots[at] = word as u16;
    }
    slots
};

/// A place in [`BY_TEXT`], by FNV-1a.
const fn hash(text: &[u8]) -> usize {
    let mut hash = 0x811c_9dc5u32;
    let mut at = 0;
    while at < text.len() {
        hash = (hash ^ text[at] as u32).wrapping_mul(0x0100_0193);
        at += 1;
    }
    (hash ^ (hash >> 16)) as usize % SLOTS
}

impl Keyword {
    /// The keyword that is written so.
    pub fn from_text(text: &str) -> Option<Keyword> {
        let mut at = hash(text.as_bytes());
        while let number @ 1.. = BY_TEXT[at] {
            let keyword = Self::ALL[usize::from(number) - 1];
            if keyword.text() == text {
                return Some(keyword);
            }
            at = (at + 1) % SLOTS;
        }
        None
    }
}

#[rustfmt::skip]
keywords! {
    AaLevel "aa_level" AaThreshold "aa_threshold" Abs "abs" Absorption "absorption" Accuracy "accuracy"
    Acos "acos" Acosh "acosh" Adaptive "adaptive" AdcBailout "adc_bailout" Agate "agate"
    AgateTurb "agate_turb" Albedo "albedo" All "all" AllIntersections "all_intersections" Alpha "alpha"
    Altitude "altitude" AlwaysSample "always_sample" Ambient "ambient" AmbientLight "ambient_light"
    Angle "angle" Anisotropy "anisotropy" Aoi "aoi" Aperture "aperture" Append "append" ArcAngle "arc_angle"
    AreaIllumination "area_illumination" AreaLight "area_light" Array "array" Asc "asc" Ascii "ascii"
    Asin "asin" Asinh "asinh" AssumedGamma "assumed_gamma" Atan "atan" Atan2 "atan2" Atanh "atanh"
    Autostop "autostop" Average "average" BSpline "b_spline" Background "background"
    BezierSpline "bezier_spline" BicubicPatch "bicubic_patch" BitwiseAnd "bitwise_and"
    BitwiseOr "bitwise_or" BitwiseXor "bitwise_xor" BlackHole "black_hole" Blob "blob" Blue "blue"
    BlurSamples "blur_samples" Bokeh "bokeh" BoundedBy "bounded_by" Box "box" Boxed "boxed" Bozo "bozo"
    Break "break" Brick "brick" BrickSize "brick_size" Brightness "brightness" Brilliance "brilliance"
    BumpMap "bump_map" BumpSize "bump_size" Bumps "bumps" Camera "camera" Case "case" Caustics "caustics"
    Ceil "ceil" Cells "cells" Charset "charset" Checker "checker" Chr "chr" Circular "circular"
    ClippedBy "clipped_by" Clock "clock" ClockOn "clock_on" Collect "collect" Color "color"
    ColorMap "color_map" Colour "colour" ColourMap "colour_map" Component "component" Composite "composite"
    Concat "concat" Cone "cone" Confidence "confidence" ConicSweep "conic_sweep"
    ConserveEnergy "conserve_energy" ContainedBy "contained_by" Control0 "control0" Control1 "control1"
    Coords "coords" Cos "cos" Cosh "cosh" Count "count" Crackle "crackle" Crand "crand" Cube "cube"
    Cubic "cubic" CubicSpline "cubic_spline" CubicWave "cubic_wave" CutawayTextures "cutaway_textures"
    Cylinder "cylinder" Cylindrical "cylindrical" Datetime "datetime" Debug "debug" Declare "declare"
    Default "default" Defined "defined" Degrees "degrees" Density "density" DensityFile "density_file"
    DensityMap "density_map" Dents "dents" Deprecated "deprecated" Df3 "df3" Difference "difference"
    Diffuse "diffuse" DimensionSize "dimension_size" Dimensions "dimensions" Direction "direction"
    Disc "disc" Dispersion "dispersion" DispersionSamples "dispersion_samples" DistExp "dist_exp"
    Distance "distance" Div "div" DoubleIlluminate "double_illuminate" Eccentricity "eccentricity"
    Else "else" Elseif "elseif" Emission "emission" End "end" Error "error" ErrorBound "error_bound"
    Evaluate "evaluate" Exp "exp" ExpandThresholds "expand_thresholds" Exponent "exponent" Exr "exr"
    Exterior "exterior" Extinction "extinction" FaceIndices "face_indices" Facets "facets"
    FadeColor "fade_color" FadeColour "fade_colour" FadeDistance "fade_distance" FadePower "fade_power"
    Falloff "falloff" FalloffAngle "falloff_angle" False "false" Fclose "fclose" FileExists "file_exists"
    Filter "filter" Finish "finish" Fisheye "fisheye" Flatness "flatness" Flip "flip" Floor "floor"
    FocalPoint "focal_point" Fog "fog" FogAlt "fog_alt" FogOffset "fog_offset" FogType "fog_type"
    Fopen "fopen" For "for" Form "form" Frequency "frequency" Fresnel "fresnel" Function "function"
    Gamma "gamma" Gather "gather" Gif "gif" GlobalLights "global_lights" GlobalSettings "global_settings"
    Gradient "gradient" Granite "granite" Gray "gray" GrayThreshold "gray_threshold" Green "green"
    Hdr "hdr" HeightField "height_field" Hexagon "hexagon" HfGray16 "hf_gray_16" Hierarchy "hierarchy" Hollow "hollow"
    Hypercomplex "hypercomplex" If "if" Ifdef "ifdef" Iff "iff" Ifndef "ifndef" ImageMap "image_map"
    ImagePattern "image_pattern" Importance "importance" Include "include" Inside "inside"
    InsideVector "inside_vector" Int "int" Interior "interior" InteriorTexture "interior_texture"
    Internal "internal" Interpolate "interpolate" Intersection "intersection" Intervals "intervals"
    Inverse "inverse" Ior "ior" Irid "irid" IridWavelength "irid_wavelength" Isosurface "isosurface"
    Jitter "jitter" Jpeg "jpeg" Julia "julia" JuliaFractal "julia_fractal" Lambda "lambda" Lathe "lathe"
    Leopard "leopard" LightGroup "light_group" LightSource "light_source" LinearSpline "linear_spline"
    LinearSweep "linear_sweep" Ln "ln" LoadFile "load_file" Local "local" Location "location" Log "log"
    LookAt "look_at" LooksLike "looks_like" LowErrorFactor "low_error_factor" Macro "macro" Magnet "magnet"
    MajorRadius "major_radius" Mandel "mandel" MapType "map_type" Marble "marble" Material "material"
    MaterialMap "material_map" Matrix "matrix" Max "max" MaxExtent "max_extent" MaxGradient "max_gradient"
    MaxIntersections "max_intersections" MaxIteration "max_iteration" MaxSample "max_sample"
    MaxTrace "max_trace" MaxTraceLevel "max_trace_level" MaximumReuse "maximum_reuse" Media "media"
    MediaAttenuation "media_attenuation" MediaInteraction "media_interaction" Merge "merge" Mesh "mesh"
    Mesh2 "mesh2" MeshCamera "mesh_camera" Metallic "metallic" Method "method" Metric "metric" Min "min"
    MinExtent "min_extent" MinimumReuse "minimum_reuse" MmPerUnit "mm_per_unit" Mod "mod" Mortar "mortar"
    NaturalSpline "natural_spline" NearestCount "nearest_count" No "no" NoBumpScale "no_bump_scale"
    NoImage "no_image" NoRadiosity "no_radiosity" NoReflection "no_reflection" NoShadow "no_shadow"
    NoiseGenerator "noise_generator" Normal "normal" NormalIndices "normal_indices" NormalMap "normal_map"
    NormalVectors "normal_vectors" Now "now" NumberOfSides "number_of_sides" NumberOfTiles "number_of_tiles"
    NumberOfWaves "number_of_waves" Object "object" Octaves "octaves" Off "off" Offset "offset"
    Omega "omega" Omnimax "omnimax" On "on" Once "once" Onion "onion" Open "open" Orient "orient"
    Orientation "orientation" Orthographic "orthographic" Ovus "ovus" Panoramic "panoramic"
    Parallel "parallel" Parametric "parametric" PassThrough "pass_through" Pattern "pattern"
    Pavement "pavement" Perspective "perspective" Pgm "pgm" Phase "phase" Phong "phong"
    PhongSize "phong_size" Photons "photons" Pi "pi" Pigment "pigment" PigmentMap "pigment_map"
    PigmentPattern "pigment_pattern" Planar "planar" Plane "plane" Png "png" PointAt "point_at" Poly "poly"
    PolyWave "poly_wave" Polygon "polygon" Polynomial "polynomial" Pot "pot" Pow "pow" Ppm "ppm"
    Precision "precision" Precompute "precompute" Premultiplied "premultiplied" PretraceEnd "pretrace_end"
    PretraceStart "pretrace_start" Prism "prism" Prod "prod" ProjectedThrough "projected_through" Pwr "pwr"
    QuadraticSpline "quadratic_spline" Quadric "quadric" Quartic "quartic" Quaternion "quaternion"
    QuickColor "quick_color" QuickColour "quick_colour" Quilted "quilted" Radial "radial" Radians "radians"
    Radiosity "radiosity" Radius "radius" Rainbow "rainbow" RampWave "ramp_wave" Rand "rand" Range "range"
    Ratio "ratio" Read "read" Reciprocal "reciprocal" RecursionLimit "recursion_limit" Red "red"
    Reflection "reflection" ReflectionExponent "reflection_exponent" Refraction "refraction" Render "render"
    Repeat "repeat" Rgb "rgb" Rgbf "rgbf" Rgbft "rgbft" Rgbt "rgbt" Right "right" Ripples "ripples"
    Rotate "rotate" Roughness "roughness" Samples "samples" SaveFile "save_file" Scale "scale"
    ScallopWave "scallop_wave" Scattering "scattering" Seed "seed" Select "select" Shadowless "shadowless"
    Sin "sin" SineWave "sine_wave" Sinh "sinh" Sint16be "sint16be" Sint16le "sint16le" Sint32be "sint32be"
    Sint32le "sint32le" Sint8 "sint8" Size "size" Sky "sky" SkySphere "sky_sphere" Slice "slice"
    Slope "slope" SlopeMap "slope_map" Smooth "smooth" SmoothTriangle "smooth_triangle" Solid "solid"
    Sor "sor" Spacing "spacing" Specular "specular" Sphere "sphere" SphereSweep "sphere_sweep"
    Spherical "spherical" Spiral1 "spiral1" Spiral2 "spiral2" Spline "spline" SplitUnion "split_union"
    Spotlight "spotlight" Spotted "spotted" Sqr "sqr" Sqrt "sqrt" Square "square" Srgb "srgb" Srgbf "srgbf"
    Srgbft "srgbft" Srgbt "srgbt" Statistics "statistics" Str "str" Strcmp "strcmp" Strength "strength"
    Strlen "strlen" Strlwr "strlwr" Strupr "strupr" Sturm "sturm" Substr "substr" Subsurface "subsurface"
    Sum "sum" Superellipsoid "superellipsoid" Switch "switch" Sys "sys" T "t" Tan "tan" Tanh "tanh"
    Target "target" Text "text" Texture "texture" TextureList "texture_list" TextureMap "texture_map"
    Tga "tga" Thickness "thickness" Threshold "threshold" Tiff "tiff" Tightness "tightness" Tile2 "tile2"
    Tiles "tiles" Tiling "tiling" Tolerance "tolerance" Toroidal "toroidal" Torus "torus" Trace "trace"
    Transform "transform" Translate "translate" Translucency "translucency" Transmit "transmit"
    Triangle "triangle" TriangleWave "triangle_wave" Triangular "triangular" True "true" Ttf "ttf"
    TurbDepth "turb_depth" Turbulence "turbulence" Type "type" U "u" USteps "u_steps" Uint16be "uint16be"
    Uint16le "uint16le" Uint8 "uint8" UltraWideAngle "ultra_wide_angle" Undef "undef" Union "union" Up "up"
    UseAlpha "use_alpha" UseColor "use_color" UseColour "use_colour" UseIndex "use_index" Utf8 "utf8"
    UvIndices "uv_indices" UvMapping "uv_mapping" UvVectors "uv_vectors" V "v" VSteps "v_steps" Val "val"
    Variance "variance" VaxisRotate "vaxis_rotate" Vcross "vcross" Vdot "vdot" Version "version"
    VertexVectors "vertex_vectors" Vlength "vlength" Vnormalize "vnormalize" Vrotate "vrotate" Vstr "vstr"
    Vturbulence "vturbulence" Warning "warning" Warp "warp" WaterLevel "water_level" Waves "waves"
    While "while" Width "width" Wood "wood" Wrinkles "wrinkles" Write "write" X "x" Y "y" Yes "yes" Z "z"
}
