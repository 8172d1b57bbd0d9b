//! Masks as COCO writes them: run lengths down the columns, as a text.

use serde::{Deserialize, Serialize};

/// The mask of one object in an image: what `pycocotools.mask.decode` takes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Rle {
    /// Height and width of the image.
    pub(crate) size: [u32; 2],
    /// The compressed run lengths.
    pub(crate) counts: String,
}

impl Rle {
    /// Encodes lengths of runs without and with the object, in turn, down the columns from left to right.
    pub(crate) fn new([width, height]: [u32; 2], runs: &[u32]) -> Rle {
        Rle { size: [height, width], counts: compressed(runs) }
    }

    /// Decodes the runs; the error says what is wrong with them.
    pub(crate) fn runs(&self) -> Result<Vec<u32>, String> {
        let runs = decompressed(&self.counts)?;
        let [height, width] = self.size.map(u64::from);
        let pixels: u64 = runs.iter().map(|run| u64::from(*run)).sum();
        if pixels != height * width {
            return Err(format!("the runs of a mask of {width} x {height} have {pixels} pixels"));
        }
        Ok(runs)
    }
}

/// Encodes runs by `rleToString` of `maskApi.c` in cocoapi. From the fourth on a run is written as the
/// difference from the one before the last; five bits per character, the lowest first.
fn compressed(runs: &[u32]) -> String {
    let mut text = String::new();
    for (index, run) in runs.iter().enumerate() {
        let before = if index > 2 { i64::from(runs[index - 2]) } else { 0 };
        let mut rest = i64::from(*run) - before;
        loop {
            let mut bits = (rest & 0x1f) as u8;
            rest >>= 5;
            let is_last = if bits & 0x10 == 0 { rest == 0 } else { rest == -1 };
            if !is_last {
                bits |= 0x20;
            }
            text.push(char::from(bits + 48));
            if is_last {
                break;
            }
        }
    }
    text
}

fn decompressed(text: &str) -> Result<Vec<u32>, String> {
    let mut runs: Vec<u32> = Vec::new();
    let mut bytes = text.bytes();
    while let Some(mut byte) = bytes.next() {
        let (mut value, mut shift) = (0i64, 0);
        loop {
            let bits = byte.checked_sub(48).filter(|bits| *bits < 64);
            let bits = bits.ok_or_else(|| format!("{:?} is no run length", char::from(byte)))?;
            if shift > 35 {
                return Err("a run length is too long".to_owned());
            }
            value |= i64::from(bits & 0x1f) << shift;
            shift += 5;
            if bits & 0x20 == 0 {
                if bits & 0x10 != 0 {
                    value |= -1 << shift;
                }
                break;
            }
            byte = bytes.next().ok_or("the last run length is cut off")?;
        }
        if runs.len() > 2 {
            value += i64::from(runs[runs.len() - 2]);
        }
        let run = u32::try_from(value).map_err(|_| format!("a run length is {value}"))?;
        runs.push(run);
    }
    Ok(runs)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_have_the_text_of_cocoapi_and_are_decoded() {
        // Four pixels, of which the last two belong to the object; one pixel that does.
        for (size, runs, text) in [([2, 2], &[2, 2][..], "22"), ([1, 1], &[0, 1], "01")] {
            let rle = Rle::new(size, runs);
            assert_eq!((&rle.counts[..], rle.runs().as_deref()), (text, Ok(runs)));
        }
        let runs = [6_000, 50, 50, 50, 1, 70_000, 13_850 - 1, 0, 10_000];
        assert_eq!(Rle::new([1000, 100], &runs).runs().as_deref(), Ok(&runs[..]));
    }

    #[test]
    fn damaged_masks_are_refused() {
        let of = |counts: &str| Rle { size: [2, 2], counts: counts.to_owned() }.runs().unwrap_err();
        assert!(of("2").contains("have 2 pixels"));
        assert!(of("2 ").contains("' ' is no run length"));
        assert!(of("2P").contains("cut off"));
        assert!(of("2Q").contains("cut off"));
        assert!(of("O").contains("a run length is -1"));
        assert!(of("PPPPPPPPPP1").contains("too long"));
    }
}
