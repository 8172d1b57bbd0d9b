//! An event camera, made of a camera's images.
//!
//! Between two images a pixel's brightness is taken to go along a straight line; whenever it has
//! gone by a threshold since the pixel's last event there is another one. This is the model of
//! H. Rebecq et al., *ESIM: an Open Event Camera Simulator*, CoRL 2018, without its adaptive
//! sampling; CARLA's is the same.

use std::f64::consts::TAU;

/// How an event camera sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EventCameraSpec {
    /// How much brighter a pixel becomes before it says so, above 0: in steps of the logarithm, or
    /// of the share of full brightness.
    pub positive_threshold: f32,
    /// How much darker, above 0.
    pub negative_threshold: f32,
    /// Standard deviation of the first, drawn anew for each event.
    pub positive_sigma: f32,
    /// Standard deviation of the second.
    pub negative_sigma: f32,
    /// For so long after an event a pixel is silent.
    pub refractory_nanos: u64,
    /// Brightness is `ln(eps + share of full brightness)`; none: the share itself.
    pub log_eps: Option<f32>,
    /// Seed of the thresholds' noise.
    pub seed: u64,
}

impl Default for EventCameraSpec {
    fn default() -> EventCameraSpec {
        EventCameraSpec {
            positive_threshold: 0.3,
            negative_threshold: 0.3,
            positive_sigma: 0.0,
            negative_sigma: 0.0,
            refractory_nanos: 0,
            log_eps: Some(0.001),
            seed: 0,
        }
    }
}

/// A pixel has become brighter or darker.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PixelEvent {
    /// Simulated time.
    pub time_nanos: u64,
    /// Column, from the left.
    pub x: u16,
    /// Row, from the top.
    pub y: u16,
    /// Brighter, or darker.
    pub is_brighter: bool,
}

/// Turns images into events.
#[derive(Clone, Debug)]
pub struct EventCamera {
    spec: EventCameraSpec,
    size: [u32; 2],
    time_nanos: u64,
    pixels: Vec<Pixel>,
}

#[derive(Clone, Copy, Debug)]
struct Pixel {
    /// In the last image.
    brightness: f32,
    /// At its last event.
    reference: f32,
    last_nanos: Option<u64>,
}

/// The least that a threshold is, whatever noise says.
const THRESHOLD_MIN: f32 = 0.01;

impl EventCamera {
    /// One that has seen nothing.
    pub fn new(spec: EventCameraSpec) -> EventCamera {
        EventCamera { spec, size: [0; 2], time_nanos: 0, pixels: Vec::new() }
    }

    /// The events since the last image, by time, then from the top left. The first image has none,
    /// nor has one of another size or of no later time: it begins anew.
    pub fn see(
        &mut self,
        [width, height]: [u32; 2],
        color: &[[u8; 4]],
        time_nanos: u64,
    ) -> Vec<PixelEvent> {
        let spec = self.spec;
        let brightness = |[r, g, b, _]: [u8; 4]| {
            let share =
                (0.2989 * f32::from(r) + 0.587 * f32::from(g) + 0.114 * f32::from(b)) / 255.0;
            spec.log_eps.map_or(share, |eps| (eps + share).ln())
        };
        let is_first = self.size != [width, height]
            || self.pixels.len() != color.len()
            || time_nanos <= self.time_nanos;
        let begin_nanos = std::mem::replace(&mut self.time_nanos, time_nanos);
        if is_first {
            self.size = [width, height];
            let fresh = |color: &[u8; 4]| {
                let brightness = brightness(*color);
                Pixel { brightness, reference: brightness, last_nanos: None }
            };
            self.pixels = color.iter().map(fresh).collect();
            return Vec::new();
        }
        let mut events = Vec::new();
        let mut noise = Noise(mixed(spec.seed ^ mixed(time_nanos)));
        for (at, (pixel, color)) in self.pixels.iter_mut().zip(color).enumerate() {
            let (before, now) = (pixel.brightness, brightness(*color));
            pixel.brightness = now;
            if before == now {
                continue;
            }
            let is_brighter = now > before;
            let (threshold, sigma, sign) = if is_brighter {
                (spec.positive_threshold, spec.positive_sigma, 1.0)
            } else {
                (spec.negative_threshold, spec.negative_sigma, -1.0)
            };
            loop {
                let drawn = if sigma > 0.0 { threshold + noise.normal(sigma) } else { threshold };
                let next = pixel.reference + sign * drawn.max(THRESHOLD_MIN);
                if (next - now) * sign > 0.0 {
                    break;
                }
                pixel.reference = next;
                let share = f64::from(((next - before) / (now - before)).clamp(0.0, 1.0));
                let since = (share * (time_nanos - begin_nanos) as f64) as u64;
                let event_nanos = begin_nanos + since;
                let silent = spec.refractory_nanos;
                if pixel.last_nanos.is_some_and(|last| silent > 0 && event_nanos < last + silent) {
                    continue;
                }
                pixel.last_nanos = Some(event_nanos);
                let (x, y) = (at as u32 % width, at as u32 / width);
                events.push(PixelEvent {
                    time_nanos: event_nanos,
                    x: x as u16,
                    y: y as u16,
                    is_brighter,
                });
            }
        }
        // Stable: those of one time stay as they were found, row by row.
        events.sort_by_key(|event| event.time_nanos);
        events
    }
}

/// Splitmix64.
struct Noise(u64);

impl Noise {
    /// Of normal distribution, by Box's and Muller's way.
    fn normal(&mut self, deviation: f32) -> f32 {
        let mut uniform = || {
            self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
            ((mixed(self.0) >> 11) + 1) as f64 / (1u64 << 53) as f64
        };
        let (radius, turn) = (uniform(), uniform());
        deviation * ((-2.0 * radius.ln()).sqrt() * (TAU * turn).cos()) as f32
    }
}

fn mixed(mut z: u64) -> u64 {
    z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ z >> 31
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [u32; 2] = [2, 1];

    fn grey(shares: [f32; 2]) -> Vec<[u8; 4]> {
        shares.iter().map(|share| [(share * 255.0).round() as u8; 4]).collect()
    }

    /// What two images, a second apart, give.
    fn events(spec: EventCameraSpec, before: [f32; 2], now: [f32; 2]) -> Vec<PixelEvent> {
        let mut camera = EventCamera::new(spec);
        assert_eq!(camera.see(SIZE, &grey(before), 1_000_000_000), []);
        camera.see(SIZE, &grey(now), 2_000_000_000)
    }

    fn linear() -> EventCameraSpec {
        EventCameraSpec { log_eps: None, ..EventCameraSpec::default() }
    }

    #[test]
    fn a_pixel_says_how_often_it_crossed_its_threshold_and_when() {
        let spec = EventCameraSpec { positive_threshold: 0.25, ..linear() };
        let found = events(spec, [0.0, 0.4], [1.0, 0.4]);
        let millis: Vec<u64> = found.iter().map(|e| (e.time_nanos + 500_000) / 1_000_000).collect();
        // 0.9998 of full white is no point_attribute quarter: the weights of the colours sum to less than 1.
        assert_eq!(millis, [1250, 1500, 1750]);
        assert!(found.iter().all(|e| (e.x, e.y, e.is_brighter) == (0, 0, true)));
    }

    #[test]
    fn darker_is_said_at_its_own_threshold_and_all_come_in_order_of_time() {
        let spec = EventCameraSpec { negative_threshold: 0.2, ..linear() };
        let found = events(spec, [0.0, 0.9], [0.5, 0.1]);
        assert_eq!(found.iter().filter(|e| e.is_brighter).count(), 1);
        assert_eq!(found.iter().filter(|e| !e.is_brighter && e.x == 1).count(), 3);
        assert!(found.is_sorted_by_key(|e| e.time_nanos));
    }

    #[test]
    fn the_logarithm_sees_shares_and_not_differences() {
        let count =
            |before, now| events(EventCameraSpec::default(), [before, 0.0], [now, 0.0]).len();
        assert!(count(0.1, 0.2) >= 2 && count(0.8, 0.9) == 0);
    }

    #[test]
    fn small_steps_add_up() {
        let mut camera = EventCamera::new(linear());
        let mut count = 0;
        for step in 0..=20u64 {
            let image = grey([step as f32 * 0.05, 0.5]);
            count += camera.see(SIZE, &image, 1 + step * 50_000_000).len();
        }
        assert_eq!(count, 3);
    }

    #[test]
    fn a_pixel_is_silent_for_as_long_as_it_is_told() {
        let spec =
            EventCameraSpec { positive_threshold: 0.1, refractory_nanos: 350_000_000, ..linear() };
        let found = events(spec, [0.0, 0.0], [1.0, 0.0]);
        assert_eq!(found.len(), 3, "at 0.1, 0.5 and 0.9 s: {found:?}");
    }

    #[test]
    fn noise_moves_thresholds_and_is_the_same_again() {
        let spec = EventCameraSpec { positive_sigma: 0.05, seed: 3, ..linear() };
        let once = events(spec, [0.0, 0.0], [1.0, 1.0]);
        assert_eq!(once, events(spec, [0.0, 0.0], [1.0, 1.0]));
        assert_ne!(once, events(EventCameraSpec { seed: 4, ..spec }, [0.0, 0.0], [1.0, 1.0]));
        assert_ne!(once, events(linear(), [0.0, 0.0], [1.0, 1.0]));
    }

    #[test]
    fn an_image_of_another_size_or_of_the_past_begins_anew() {
        let mut camera = EventCamera::new(linear());
        camera.see(SIZE, &grey([0.0, 0.0]), 1_000);
        assert_eq!(camera.see([1, 2], &grey([1.0, 1.0]), 2_000), []);
        assert_eq!(camera.see([1, 2], &grey([0.0, 0.0]), 1_500), []);
        assert!(!camera.see([1, 2], &grey([1.0, 1.0]), 2_000).is_empty());
    }
}
