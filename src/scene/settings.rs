//! The parts of `global_settings` that belong to what is not rendered: radiosity and photons (manual sections 3.4.1.9, 3.4.1.10).

/// Light that surfaces send each other. POV-Ray 3.7's defaults.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs, reason = "the names are the manual's")]
pub struct Radiosity {
    pub adc_bailout: f64,
    pub always_sample: bool,
    pub brightness: f64,
    pub count: f64,
    pub error_bound: f64,
    pub gray_threshold: f64,
    pub low_error_factor: f64,
    /// 0 and below is none.
    pub max_sample: f64,
    pub maximum_reuse: f64,
    pub media: bool,
    pub minimum_reuse: f64,
    /// How many samples are averaged, at least and at most.
    pub nearest_count: [f64; 2],
    pub normal: bool,
    /// As shares of the picture's width.
    pub pretrace_end: f64,
    pub pretrace_start: f64,
    pub recursion_limit: f64,
    pub subsurface: bool,
    /// Samples are kept in these files.
    pub load_file: Option<String>,
    /// See `load_file`.
    pub save_file: Option<String>,
}

/// Light that is sent out from lamps and kept where it falls.
#[derive(Debug, Clone, PartialEq, Default)]
#[allow(missing_docs, reason = "the names are the manual's")]
pub struct Photons {
    /// About how many.
    pub count: f64,
    /// Between them; one of the two is 0.
    pub spacing: f64,
    /// How many are gathered at a point, at least and at most.
    pub gather: Option<[f64; 2]>,
    pub jitter: Option<f64>,
    pub autostop: Option<f64>,
    pub max_trace_level: Option<f64>,
    pub adc_bailout: Option<f64>,
    pub expand_thresholds: Option<[f64; 2]>,
    /// Steps within media, and a factor.
    pub media: Option<[f64; 2]>,
    /// Radius of gathering and its multipliers, for surfaces and for media.
    pub radius: Vec<f64>,
    pub load_file: Option<String>,
    pub save_file: Option<String>,
}

/// What an object or a light says of photons: `photons { ... }`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[allow(missing_docs, reason = "the names are the manual's")]
pub struct PhotonUse {
    pub target: Option<f64>,
    pub refraction: Option<bool>,
    pub reflection: Option<bool>,
    pub collect: Option<bool>,
    pub pass_through: bool,
    pub area_light: bool,
}

impl Default for Radiosity {
    fn default() -> Self {
        Self {
            adc_bailout: 0.01,
            always_sample: true,
            brightness: 1.0,
            count: 35.0,
            error_bound: 1.8,
            gray_threshold: 0.0,
            low_error_factor: 0.5,
            max_sample: -1.0,
            maximum_reuse: 0.2,
            media: false,
            minimum_reuse: 0.015,
            nearest_count: [5.0, 0.0],
            normal: false,
            pretrace_end: 0.04,
            pretrace_start: 0.08,
            recursion_limit: 2.0,
            subsurface: false,
            load_file: None,
            save_file: None,
        }
    }
}
