//! Statistics of a feature, as LeRobot keeps them: of each number of a vector, or of each channel of
//! images.

use serde_json::{Value, json};

use crate::collect::decode::Image;

/// The quantiles, and the names of all numbers.
const QUANTILES: [f64; 5] = [0.01, 0.1, 0.5, 0.9, 0.99];
pub(crate) const NAMES: [&str; 9] =
    ["min", "max", "mean", "std", "q01", "q10", "q50", "q90", "q99"];

/// The statistics of one feature.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Statistics {
    /// For each of [`NAMES`] a number for each number of the vector.
    pub(crate) numbers: [Vec<f64>; 9],
    /// The number of vectors or images.
    pub(crate) count: u64,
}

/// The number of each value of the samples in each channel.
pub(crate) struct Histogram {
    channels: [[u64; 256]; 3],
    images: u64,
}

impl Statistics {
    /// Returns the statistics of at least one vector; `width` numbers are a vector.
    pub(crate) fn of(values: &[f64], width: usize) -> Statistics {
        let columns = (0..width).map(|column| {
            let mut sorted: Vec<f64> = values.iter().skip(column).step_by(width).copied().collect();
            sorted.sort_by(f64::total_cmp);
            let count = sorted.len() as f64;
            let mean = sorted.iter().sum::<f64>() / count;
            let variance = sorted.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / count;
            numbers(sorted.len() as u64, mean, variance, |rank| sorted[rank as usize])
        });
        Statistics::of_columns(columns, (values.len() / width) as u64)
    }

    fn of_columns(columns: impl Iterator<Item = [f64; 9]>, count: u64) -> Statistics {
        let mut made = Statistics { numbers: Default::default(), count };
        for column in columns {
            for (list, number) in made.numbers.iter_mut().zip(column) {
                list.push(number);
            }
        }
        made
    }

    /// Joins those of two sets, by the rule of LeRobot's `aggregate_stats`: the quantiles up to the
    /// median are the lesser ones, those above the greater ones.
    pub(crate) fn join(&mut self, other: &Statistics) {
        let count = self.count + other.count;
        let [ours, theirs] = [self.count, other.count].map(|part| part as f64 / count as f64);
        for column in 0..self.numbers[0].len() {
            let [a, b] = [&*self, other].map(|s| s.numbers.each_ref().map(|list| list[column]));
            let mean = ours * a[2] + theirs * b[2];
            let spread = |of: [f64; 9]| of[3].powi(2) + (of[2] - mean).powi(2);
            let std = (ours * spread(a) + theirs * spread(b)).sqrt();
            for (index, list) in self.numbers.iter_mut().enumerate() {
                list[column] = match index {
                    2 => mean,
                    3 => std,
                    0 | 4..=6 => a[index].min(b[index]),
                    _ => a[index].max(b[index]),
                };
            }
        }
        self.count = count;
    }

    /// Returns the statistics as JSON: lists, in images of one pixel by channel.
    pub(crate) fn json(&self, is_image: bool) -> Value {
        let list = |numbers: &Vec<f64>| match is_image {
            true => json!(numbers.iter().map(|number| [[number]]).collect::<Vec<_>>()),
            false => json!(numbers),
        };
        let mut made: serde_json::Map<_, _> = (NAMES.iter().zip(&self.numbers))
            .map(|(name, numbers)| ((*name).to_owned(), list(numbers)))
            .collect();
        made.insert("count".to_owned(), json!([self.count]));
        made.into()
    }
}

impl Histogram {
    pub(crate) fn new() -> Histogram {
        Histogram { channels: [[0; 256]; 3], images: 0 }
    }

    /// Adds the pixels of an image, 8-bit RGB.
    pub(crate) fn add(&mut self, image: &Image) {
        self.images += 1;
        for pixel in image.bytes.chunks_exact(3) {
            for (channel, value) in self.channels.iter_mut().zip(pixel) {
                channel[usize::from(*value)] += 1;
            }
        }
    }

    /// Returns the statistics of at least one image, with 1 for the brightest value.
    pub(crate) fn statistics(&self) -> Statistics {
        let columns = self.channels.iter().map(|channel| {
            let values = || (0..).map(|value: u32| f64::from(value) / 255.0).zip(channel);
            let count: u64 = channel.iter().sum();
            let sum_of = |of: &dyn Fn(f64) -> f64| {
                values().map(|(value, pixels)| of(value) * *pixels as f64).sum::<f64>()
            };
            let mean = sum_of(&|value| value) / count as f64;
            let variance = sum_of(&|value| (value - mean).powi(2)) / count as f64;
            numbers(count, mean, variance, |rank| {
                let mut before = 0;
                let at = |(value, pixels): (f64, &u64)| {
                    before += pixels;
                    (before > rank).then_some(value)
                };
                values().find_map(at).unwrap_or(1.0)
            })
        });
        Statistics::of_columns(columns, self.images)
    }
}

/// Returns the numbers of [`NAMES`]; `at` returns the value of a rank from 0. A quantile between two
/// ranks is interpolated, as `numpy.quantile` does.
fn numbers(count: u64, mean: f64, variance: f64, mut at: impl FnMut(u64) -> f64) -> [f64; 9] {
    let last = count - 1;
    let [q01, q10, q50, q90, q99] = QUANTILES.map(|quantile| {
        let rank = quantile * last as f64;
        let below = rank.floor() as u64;
        let (low, high) = (at(below), at((below + 1).min(last)));
        low + (high - low) * rank.fract()
    });
    [at(0), at(last), mean, variance.sqrt(), q01, q10, q50, q90, q99]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(made: &Statistics, column: usize, expected: [f64; 9]) {
        for ((name, list), expected) in NAMES.iter().zip(&made.numbers).zip(expected) {
            assert!((list[column] - expected).abs() < 1e-12, "{name}: {list:?}, {expected}");
        }
    }

    /// Expected numbers by `numpy` 2.4.
    const OF_1_4_9_16: [f64; 9] =
        [1.0, 16.0, 7.5, 5.678_908_345_800_273, 1.09, 1.9, 6.5, 13.9, 15.79];

    #[test]
    fn each_number_of_a_vector_has_statistics() {
        let made = Statistics::of(&[16.0, 0.5, 1.0, 0.5, 9.0, 0.5, 4.0, 0.5], 2);
        assert_eq!(made.count, 4);
        close(&made, 0, OF_1_4_9_16);
        close(&made, 1, [0.5, 0.5, 0.5, 0.0, 0.5, 0.5, 0.5, 0.5, 0.5]);
    }

    #[test]
    fn channels_have_the_statistics_of_their_pixels() {
        let mut histogram = Histogram::new();
        // Red differs by pixel.
        let bytes = [[16, 7, 0], [1, 7, 0], [9, 7, 0], [4, 7, 0]].concat();
        histogram.add(&Image { width: 2, height: 2, bytes });
        let made = histogram.statistics();
        assert_eq!(made.count, 1);
        close(&made, 0, OF_1_4_9_16.map(|number| number / 255.0));
        assert_eq!([made.numbers[0][1], made.numbers[1][2]], [7.0 / 255.0, 0.0]);
    }

    #[test]
    fn joined_statistics_have_the_mean_and_the_deviation_of_all() {
        let mut joined = Statistics::of(&[1.0, 4.0, 9.0], 1);
        joined.join(&Statistics::of(&[16.0], 1));
        assert_eq!(joined.count, 4);
        let quantiles = [1.06, 1.6, 4.0, 16.0, 16.0];
        let [min, max, mean, std, ..] = OF_1_4_9_16;
        let [a, b, c, d, e] = quantiles;
        close(&joined, 0, [min, max, mean, std, a, b, c, d, e]);
    }
}
