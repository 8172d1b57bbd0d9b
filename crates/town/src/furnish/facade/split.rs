//! The split of a length into parts: absolute sizes first, then shares of what is left.

/// How much of a length a part takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Extent {
    /// As many metres.
    Size(f32),
    /// As a weight against other shares of what the sizes leave.
    Share(f32),
    /// A share of weight 1, tiled by pieces of about as many metres, at least one.
    Each(f32),
}

/// A piece of a split: the number of its part, and its begin and end. Metres.
pub(super) type Piece = (usize, [f32; 2]);

/// Splits the range from `from` to `to`; the pieces cover it without gaps and in order.
///
/// Sizes that exceed the range are reduced in proportion, and so are enlarged those that fill too
/// little of it when nothing shares the rest. Empty parts have no piece.
pub(super) fn split(from: f32, to: f32, parts: &[Extent]) -> Vec<Piece> {
    let length = to - from;
    let (mut fixed, mut shares) = (0.0, 0.0);
    for part in parts {
        match part {
            Extent::Size(size) => fixed += size,
            Extent::Share(share) => shares += share,
            Extent::Each(_) => shares += 1.0,
        }
    }
    let rest = (length - fixed).max(0.0);
    let stretch = if fixed > length || shares <= 0.0 { length / fixed } else { 1.0 };
    let mut pieces = Vec::new();
    let mut at = from;
    for (number, part) in parts.iter().enumerate() {
        let (size, count) = match part {
            Extent::Size(size) => (size * stretch, 1),
            Extent::Share(share) => (rest * share / shares, 1),
            Extent::Each(pitch) => {
                let size = rest / shares;
                (size, (size / pitch).round().max(1.0) as usize)
            }
        };
        if size <= 1e-4 {
            continue;
        }
        for piece in 0..count {
            let end = at + size * (piece + 1) as f32 / count as f32;
            let begin = pieces.last().map_or(from, |(_, [_, end]): &Piece| *end);
            pieces.push((number, [begin, end]));
        }
        at += size;
    }
    // Rounding leaves no gap at the end.
    if let Some((_, [_, end])) = pieces.last_mut() {
        *end = to;
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_cover_the_range_in_order_and_sum_to_it() {
        use Extent::{Each, Share, Size};
        let rules: [&[Extent]; 6] = [
            &[Size(0.5), Each(3.1), Size(0.4)],
            &[Share(1.0), Size(1.7), Share(2.0)],
            &[Size(9.0), Size(30.0), Share(1.0)],
            &[Size(1.0), Size(2.0)],
            &[Each(2.5), Size(2.8), Each(2.5)],
            &[Share(1.0)],
        ];
        for parts in rules {
            for length in [0.3f32, 2.0, 7.77, 31.4] {
                let pieces = split(-length * 0.5, length * 0.5, parts);
                assert_eq!(pieces[0].1[0], -length * 0.5);
                assert_eq!(pieces[pieces.len() - 1].1[1], length * 0.5);
                for pair in pieces.windows(2) {
                    assert_eq!(pair[0].1[1], pair[1].1[0], "{parts:?}");
                    assert!(pair[0].0 <= pair[1].0 && pair[0].1[0] < pair[0].1[1]);
                }
                let sum: f32 = pieces.iter().map(|(_, [begin, end])| end - begin).sum();
                assert!((sum - length).abs() < 1e-4 * length.max(1.0), "{parts:?}: {sum}");
            }
        }
    }

    #[test]
    fn sizes_are_kept_and_shares_divide_the_rest() {
        use Extent::{Each, Share, Size};
        let widths = |parts: &[Extent], length: f32| -> Vec<f32> {
            split(0.0, length, parts).iter().map(|(_, [a, b])| b - a).collect()
        };
        assert_eq!(widths(&[Share(1.0), Size(2.0), Share(3.0)], 10.0), [2.0, 2.0, 6.0]);
        assert_eq!(widths(&[Size(1.0), Each(2.0), Size(1.0)], 8.5).len(), 5);
        assert_eq!(widths(&[Size(2.0), Size(6.0)], 4.0), [1.0, 3.0]);
    }
}
