//! Arrays of NumPy in files: version 1.0 of its format (numpy.lib.format), rows first.

const MAGIC: &[u8] = b"\x93NUMPY\x01\x00";

/// The data begin at a multiple of this.
const ALIGNMENT: usize = 64;

/// Begins a file of `shape`, such as `(600, 800, 3)`, with elements of `kind`, such as `|u1`.
pub(crate) fn head(kind: &str, shape: &str, file: &mut Vec<u8>) {
    file.clear();
    file.extend_from_slice(MAGIC);
    let text = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}");
    let length = (MAGIC.len() + 2 + text.len() + 1).next_multiple_of(ALIGNMENT);
    let text_length = (length - MAGIC.len() - 2) as u16;
    file.extend_from_slice(&text_length.to_le_bytes());
    file.extend_from_slice(text.as_bytes());
    file.resize(length - 1, b' ');
    file.push(b'\n');
}

/// An array in the bytes of a file.
#[derive(Debug, PartialEq)]
pub(crate) struct Array<'a> {
    /// As in `|u1`.
    pub(crate) kind: &'a str,
    pub(crate) shape: Vec<usize>,
    pub(crate) bytes: &'a [u8],
}

/// Reads what [`head`] and the data after it wrote.
pub(crate) fn parse(file: &[u8]) -> Result<Array<'_>, String> {
    let wrong = || "no array of NumPy as omnibus collect writes it".to_owned();
    let after = file.strip_prefix(MAGIC).ok_or_else(wrong)?;
    let (length, after) = after.split_first_chunk::<2>().ok_or_else(wrong)?;
    let (text, bytes) =
        after.split_at_checked(u16::from_le_bytes(*length).into()).ok_or_else(wrong)?;
    let text = std::str::from_utf8(text).map_err(|_| wrong())?;
    let between = |from: &str, to: &str| {
        let (_, rest) = text.split_once(from)?;
        Some(rest.split_once(to)?.0)
    };
    let kind = between("'descr': '", "'").ok_or_else(wrong)?;
    let shape = between("'shape': (", ")").ok_or_else(wrong)?;
    let sides = shape.split(',').map(|side| side.trim().parse::<usize>());
    let shape = sides.collect::<Result<Vec<_>, _>>().map_err(|_| wrong())?;
    let size: usize = kind.get(2..).and_then(|size| size.parse().ok()).ok_or_else(wrong)?;
    let wanted = shape.iter().try_fold(size, |product, side| product.checked_mul(*side));
    if wanted != Some(bytes.len()) {
        return Err(format!("{} bytes of data, but the shape is {shape:?} of {kind}", bytes.len()));
    }
    Ok(Array { kind, shape, bytes })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_array_is_read_as_it_was_written_and_its_data_are_aligned() {
        for shape in ["(2, 3)", "(1, 2, 3)", "(1000, 0)"] {
            let mut file = vec![9];
            head("<u4", shape, &mut file);
            assert_eq!(file.len() % ALIGNMENT, 0);
            assert_eq!(file.last(), Some(&b'\n'));
            let data = if shape.contains('0') { vec![] } else { vec![7; 24] };
            file.extend(&data);
            let array = parse(&file).unwrap();
            assert_eq!((array.kind, array.bytes), ("<u4", &data[..]));
            assert_eq!(format!("{:?}", array.shape), shape.replace('(', "[").replace(')', "]"));
        }
    }

    #[test]
    fn a_file_that_is_cut_anywhere_is_refused() {
        let mut file = Vec::new();
        head("<u4", "(2, 3)", &mut file);
        file.extend([7; 24]);
        for length in 0..file.len() {
            assert!(parse(&file[..length]).is_err(), "{length} bytes");
        }
        file.push(0);
        assert!(parse(&file).unwrap_err().contains("25 bytes"));
    }
}
