//! An event camera, made of a camera's images.
//!
//! The brightness of a pixel is interpolated linearly between two images. Whenever it has changed by
//! a threshold since the pixel's last event, there is another event. This is the model of H. Rebecq
//! et al., *ESIM: an Open Event Camera Simulator*, CoRL 2018, without its adaptive sampling; CARLA's
//! is the same.

use mesh::{RandomStream, mix64};

/// The parameters of an event camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EventCameraSpec {
    /// The increase of brightness that makes an event, above 0: of the logarithm, or of the fraction
    /// of full brightness without [`EventCameraSpec::log_eps`].
    pub positive_threshold: f32,
    /// The decrease of brightness that makes an event, above 0.
    pub negative_threshold: f32,
    /// Standard deviation of the threshold of increases, drawn for each event.
    pub positive_sigma: f32,
    /// Standard deviation of the threshold of decreases, drawn for each event.
    pub negative_sigma: f32,
    /// Refractory period: time after an event in which the pixel gives no other, nanoseconds.
    pub refractory_nanos: u64,
    /// The offset in `ln(eps + fraction of full brightness)`; `None` uses the fraction itself.
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

/// A change of one pixel's brightness by a threshold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PixelEvent {
    /// Simulated time, nanoseconds.
    pub time_nanos: u64,
    /// Column, from the left.
    pub x: u16,
    /// Row, from the top.
    pub y: u16,
    /// Whether the pixel became brighter; else it became darker.
    pub is_brighter: bool,
}

/// An event camera: turns the images of a camera into events. `Send` and `Sync`.
#[derive(Clone, Debug)]
pub struct EventCamera {
    spec: EventCameraSpec,
    size: [u32; 2],
    time_nanos: u64,
    pixels: Vec<Pixel>,
}

#[derive(Clone, Copy, Debug)]
struct Pixel {
    /// Brightness in the last image.
    brightness: f32,
    /// Brightness at the last event.
    reference: f32,
    /// Simulated time of the last event.
    last_nanos: Option<u64>,
}

/// The lower bound of a threshold with noise.
const THRESHOLD_MIN: f32 = 0.01;

impl EventCamera {
    /// Creates a camera without an image.
    #[must_use]
    pub fn new(spec: EventCameraSpec) -> EventCamera {
        EventCamera { spec, size: [0; 2], time_nanos: 0, pixels: Vec::new() }
    }

    /// Takes the next image: its width and height, its pixels row by row from the top left (red,
    /// green, blue and an ignored byte, sRGB), and its simulated time. Returns the events since the
    /// image before, sorted by time and then row by row. The first image has no events, and neither
    /// has one of another size or of no later time: it replaces the image before.
    #[must_use]
    pub fn update(
        &mut self,
        [width, height]: [u32; 2],
        color: &[[u8; 4]],
        time_nanos: u64,
    ) -> Vec<PixelEvent> {
        let spec = self.spec;
        let brightness = |[r, g, b, _]: [u8; 4]| {
            let fraction =
                (0.2989 * f32::from(r) + 0.587 * f32::from(g) + 0.114 * f32::from(b)) / 255.0;
            spec.log_eps.map_or(fraction, |eps| (eps + fraction).ln())
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
        let mut noise = RandomStream::from_state(mix64(spec.seed ^ mix64(time_nanos)));
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
                let drawn = if sigma > 0.0 {
                    threshold + sigma * noise.normal(1.0) as f32
                } else {
                    threshold
                };
                let next = pixel.reference + sign * drawn.max(THRESHOLD_MIN);
                if (next - now) * sign > 0.0 {
                    break;
                }
                pixel.reference = next;
                let fraction = f64::from(((next - before) / (now - before)).clamp(0.0, 1.0));
                let since = (fraction * (time_nanos - begin_nanos) as f64) as u64;
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
        // A stable sort: events of one time stay row by row.
        events.sort_by_key(|event| event.time_nanos);
        events
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [u32; 2] = [2, 1];

    fn grey(shares: [f32; 2]) -> Vec<[u8; 4]> {
        shares.iter().map(|share| [(share * 255.0).round() as u8; 4]).collect()
    }

    /// Returns the events of two images that are a second apart.
    fn events(spec: EventCameraSpec, before: [f32; 2], now: [f32; 2]) -> Vec<PixelEvent> {
        let mut camera = EventCamera::new(spec);
        assert_eq!(camera.update(SIZE, &grey(before), 1_000_000_000), []);
        camera.update(SIZE, &grey(now), 2_000_000_000)
    }

    fn linear() -> EventCameraSpec {
        EventCameraSpec { log_eps: None, ..EventCameraSpec::default() }
    }

    #[test]
    fn a_pixel_gives_an_event_with_its_time_for_each_crossed_threshold() {
        let spec = EventCameraSpec { positive_threshold: 0.25, ..linear() };
        let found = events(spec, [0.0, 0.4], [1.0, 0.4]);
        let millis: Vec<u64> = found.iter().map(|e| (e.time_nanos + 500_000) / 1_000_000).collect();
        // White is 0.9999 and not 1, because the weights of the colours sum to less than 1: the
        // fourth threshold is not reached.
        assert_eq!(millis, [1250, 1500, 1750]);
        assert!(found.iter().all(|e| (e.x, e.y, e.is_brighter) == (0, 0, true)));
    }

    #[test]
    fn decreases_have_their_own_threshold_and_events_are_sorted_by_time() {
        let spec = EventCameraSpec { negative_threshold: 0.2, ..linear() };
        let found = events(spec, [0.0, 0.9], [0.5, 0.1]);
        assert_eq!(found.iter().filter(|e| e.is_brighter).count(), 1);
        assert_eq!(found.iter().filter(|e| !e.is_brighter && e.x == 1).count(), 3);
        assert!(found.is_sorted_by_key(|e| e.time_nanos));
    }

    #[test]
    fn the_logarithm_measures_ratios_and_not_differences() {
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
            count += camera.update(SIZE, &image, 1 + step * 50_000_000).len();
        }
        assert_eq!(count, 3);
    }

    #[test]
    fn a_pixel_gives_no_event_within_its_refractory_period() {
        let spec =
            EventCameraSpec { positive_threshold: 0.1, refractory_nanos: 350_000_000, ..linear() };
        let found = events(spec, [0.0, 0.0], [1.0, 0.0]);
        assert_eq!(found.len(), 3, "at 0.1, 0.5 and 0.9 s: {found:?}");
    }

    #[test]
    fn noise_changes_thresholds_and_depends_on_the_seed_alone() {
        let spec = EventCameraSpec { positive_sigma: 0.05, seed: 3, ..linear() };
        let once = events(spec, [0.0, 0.0], [1.0, 1.0]);
        assert_eq!(once, events(spec, [0.0, 0.0], [1.0, 1.0]));
        assert_ne!(once, events(EventCameraSpec { seed: 4, ..spec }, [0.0, 0.0], [1.0, 1.0]));
        assert_ne!(once, events(linear(), [0.0, 0.0], [1.0, 1.0]));
    }

    #[test]
    fn an_image_of_another_size_or_of_the_past_replaces_the_one_before() {
        let mut camera = EventCamera::new(linear());
        assert_eq!(camera.update(SIZE, &grey([0.0, 0.0]), 1_000), []);
        assert_eq!(camera.update([1, 2], &grey([1.0, 1.0]), 2_000), []);
        assert_eq!(camera.update([1, 2], &grey([0.0, 0.0]), 1_500), []);
        assert!(!camera.update([1, 2], &grey([1.0, 1.0]), 2_000).is_empty());
    }
}
