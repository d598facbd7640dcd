//! `global_settings { ... }` (manual section 3.4.1), and what objects and lights say of radiosity and photons.

use super::item::{ANY, Bounds, NOT_NEGATIVE, POSITIVE};
use super::machine::{Machine, Res};
use crate::lang::{Keyword, Mark, Token};
use crate::scene::noise::Generator;
use crate::scene::{Gamma, PhotonUse, Photons, Radiosity};

/// POV-Ray's bounds of the samples that are averaged.
const NEAREST: Bounds = (1.0, 20.0);
/// POV-Ray's largest `max_trace_level`.
const MOST_LEVELS: f64 = 256.0;
/// Shares of a picture's width.
const SHARE: Bounds = (f64::MIN_POSITIVE, 1.0);

impl Machine<'_> {
    /// The block behind `global_settings`.
    pub fn global_settings(&mut self) -> Res<()> {
        let open = self.open("global_settings")?;
        while self.global_setting()? {}
        self.close("global_settings", open)
    }

    fn global_setting(&mut self) -> Res<bool> {
        use Keyword as K;
        let at = self.peek_lexeme()?;
        let Token::Word(word) = at.token else { return Ok(false) };
        match word {
            K::AssumedGamma => {
                self.next()?;
                let gamma = if self.accept_word(K::Srgb)? {
                    Gamma::Srgb
                } else {
                    Gamma::Power(self.bounded(word, POSITIVE)?)
                };
                // The first one counts (measured).
                if self.gamma_set {
                    self.warn(
                        "assumed_gamma",
                        "`assumed_gamma` is set already: this one is ignored",
                        self.span(at),
                    );
                } else {
                    self.gamma_set = true;
                    self.scene.globals.assumed_gamma = gamma;
                }
            }
            K::MaxTraceLevel => {
                self.next()?;
                let level = self.finite()?;
                if level > MOST_LEVELS {
                    let message = format!("`max_trace_level` is at most {MOST_LEVELS}, found {level}");
                    self.warn("max_trace_level", message, self.span(self.last));
                }
                self.scene.globals.max_trace_level = level.clamp(1.0, MOST_LEVELS) as u32;
            }
            K::AdcBailout => {
                self.next()?;
                self.scene.globals.adc_bailout = self.finite()?;
            }
            K::AmbientLight => {
                self.next()?;
                self.scene.globals.ambient_light = self.rgb()?;
            }
            K::IridWavelength => {
                self.next()?;
                self.scene.globals.irid_wavelength = self.rgb()?;
            }
            K::NoiseGenerator => {
                self.next()?;
                let generator = Generator::numbered(self.integer("`noise_generator`", 1, 3)? as u8);
                self.scene.globals.noise_generator = generator.unwrap_or_default();
                self.generator_set = true;
                if generator.is_none() {
                    let lacks = self.lack("noise_generator", at);
                    self.miss(&lacks);
                }
            }
            K::NumberOfWaves | K::MmPerUnit => {
                self.next()?;
                self.finite()?;
            }
            K::MaxIntersections => {
                self.next()?;
                self.finite()?;
                self.warn("no effect", "`max_intersections` has no effect since version 3.7", self.span(at));
            }
            K::HfGray16 => {
                self.next()?;
                self.switch_value()?;
                self.warn("no effect", "`hf_gray_16` has no effect since version 3.7", self.span(at));
            }
            K::Charset => {
                self.next()?;
                let Token::Word(charset @ (K::Ascii | K::Utf8 | K::Sys)) = self.peek()? else {
                    return self.expected("`ascii`, `utf8` or `sys`");
                };
                self.next()?;
                self.ascii = charset == K::Ascii;
            }
            K::Radiosity => {
                self.next()?;
                let radiosity = self.radiosity()?;
                self.scene.globals.radiosity = Some(Box::new(radiosity));
                let lacks = self.lack("radiosity", at);
                self.miss(&lacks);
            }
            // `photons` without a target and `subsurface` without a finish that has it change nothing.
            K::Photons => {
                self.next()?;
                let photons = self.photons()?;
                self.scene.globals.photons = Some(Box::new(photons));
                self.ignore(word.text(), at);
            }
            K::Subsurface => {
                self.next()?;
                let open = self.open("subsurface")?;
                loop {
                    if self.accept_word(K::Samples)? {
                        self.finite()?;
                        self.comma()?;
                        self.finite()?;
                    } else if !self.switch_item(&mut [(K::Radiosity, &mut false)])? {
                        break;
                    }
                }
                self.close("subsurface", open)?;
                self.ignore(word.text(), at);
            }
            _ => return Ok(false),
        }
        Ok(true)
    }

    /// The block behind `radiosity` in the global settings.
    pub fn radiosity(&mut self) -> Res<Radiosity> {
        use Keyword as K;
        let open = self.open("radiosity")?;
        let mut r = Radiosity::default();
        loop {
            if self.accept_word(K::NearestCount)? {
                let least = self.bounded(K::NearestCount, NEAREST)?;
                let most = if self.accept(Mark::Comma)? {
                    self.bounded(K::NearestCount, (0.0, least))?
                } else {
                    0.0
                };
                r.nearest_count = [least, most];
            } else if self.accept_word(K::Count)? {
                r.count = self.bounded(K::Count, POSITIVE)?;
                if self.accept(Mark::Comma)? {
                    self.finite()?;
                }
            } else if !self.bounded_item(&mut [
                (K::AdcBailout, &mut r.adc_bailout, POSITIVE),
                (K::Brightness, &mut r.brightness, POSITIVE),
                (K::ErrorBound, &mut r.error_bound, POSITIVE),
                (K::GrayThreshold, &mut r.gray_threshold, (0.0, 1.0)),
                (K::LowErrorFactor, &mut r.low_error_factor, POSITIVE),
                (K::MaxSample, &mut r.max_sample, ANY),
                (K::MaximumReuse, &mut r.maximum_reuse, POSITIVE),
                (K::MinimumReuse, &mut r.minimum_reuse, NOT_NEGATIVE),
                (K::PretraceEnd, &mut r.pretrace_end, SHARE),
                (K::PretraceStart, &mut r.pretrace_start, SHARE),
                (K::RecursionLimit, &mut r.recursion_limit, NEAREST),
            ])? && !self.switch_item(&mut [
                (K::AlwaysSample, &mut r.always_sample),
                (K::Media, &mut r.media),
                (K::Normal, &mut r.normal),
                (K::Subsurface, &mut r.subsurface),
            ])? && !self
                .string_item(&mut [(K::LoadFile, &mut r.load_file), (K::SaveFile, &mut r.save_file)])?
            {
                break;
            }
        }
        self.close("radiosity", open)?;
        Ok(r)
    }

    /// The block behind `photons` in the global settings.
    fn photons(&mut self) -> Res<Photons> {
        use Keyword as K;
        self.block(
            "photons",
            |_| None,
            Photons::default(),
            |m, photons, word| {
                match word {
                    K::Gather | K::ExpandThresholds | K::Media => {
                        m.next()?;
                        let first = m.finite()?;
                        let second = if m.accept(Mark::Comma)? { m.finite()? } else { 1.0 };
                        *match word {
                            K::Gather => &mut photons.gather,
                            K::Media => &mut photons.media,
                            _ => &mut photons.expand_thresholds,
                        } = Some([first, second]);
                    }
                    K::Jitter | K::Autostop | K::MaxTraceLevel | K::AdcBailout => {
                        m.next()?;
                        *match word {
                            K::Jitter => &mut photons.jitter,
                            K::Autostop => &mut photons.autostop,
                            K::MaxTraceLevel => &mut photons.max_trace_level,
                            _ => &mut photons.adc_bailout,
                        } = Some(m.finite()?);
                    }
                    K::Radius => {
                        m.next()?;
                        photons.radius.clear();
                        while photons.radius.len() < 4
                            && let Some(value) = m.optional_float()?
                        {
                            photons.radius.push(value);
                            m.comma()?;
                        }
                    }
                    _ => {
                        return Ok(m.bounded_item(&mut [
                            (K::Count, &mut photons.count, POSITIVE),
                            (K::Spacing, &mut photons.spacing, POSITIVE),
                        ])? || m.string_item(&mut [
                            (K::LoadFile, &mut photons.load_file),
                            (K::SaveFile, &mut photons.save_file),
                        ])?);
                    }
                }
                Ok(true)
            },
        )
    }

    /// The block behind `photons` of an object or a light.
    pub fn photon_use(&mut self) -> Res<PhotonUse> {
        use Keyword as K;
        self.block(
            "photons",
            |_| None,
            PhotonUse::default(),
            |m, photons, word| {
                match word {
                    K::Target => {
                        m.next()?;
                        photons.target = Some(m.optional_float()?.unwrap_or(1.0));
                    }
                    K::Refraction | K::Reflection | K::Collect => {
                        m.next()?;
                        *match word {
                            K::Refraction => &mut photons.refraction,
                            K::Reflection => &mut photons.reflection,
                            _ => &mut photons.collect,
                        } = Some(m.switch_value()?);
                    }
                    _ => {
                        return m.switch_item(&mut [
                            (K::PassThrough, &mut photons.pass_through),
                            (K::AreaLight, &mut photons.area_light),
                        ]);
                    }
                }
                Ok(true)
            },
        )
    }

    /// The block behind `radiosity` of an object: how much it matters.
    pub fn radiosity_importance(&mut self) -> Res<f64> {
        self.block(
            "radiosity",
            |_| None,
            1.0,
            |m, importance, _| m.bounded_item(&mut [(Keyword::Importance, importance, SHARE)]),
        )
    }
}
