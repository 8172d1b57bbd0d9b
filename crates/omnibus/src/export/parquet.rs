//! Parquet files: tables whose columns hold values, lists of one shape, or images.
//!
//! Nothing is compressed, because nearly all bytes are those of images. The columns of a row group
//! follow each other in a file, and each goes to the file as it is written, so that a row group is
//! never in memory as a whole.

use std::{
    fs::File,
    path::{Path, PathBuf},
    sync::Arc,
};

use ::parquet::{
    basic::{Compression, ConvertedType, LogicalType, Repetition, Type as Physical},
    data_type::{ByteArray, ByteArrayType, DataType, DoubleType, FloatType, Int64Type},
    errors::Result as ParquetResult,
    file::{
        metadata::KeyValue,
        properties::{EnabledStatistics, WriterProperties, WriterVersion},
        writer::{SerializedColumnWriter, SerializedFileWriter, SerializedRowGroupWriter},
    },
    schema::types::{ColumnPath, Type, TypePtr},
};
use anyhow::Context;

use crate::export::writing::writing;

/// A column of a row group, without images.
pub(crate) struct Column {
    pub(crate) name: String,
    /// The lengths of the lists in a row, the outermost first; empty: a row is one value.
    pub(crate) shape: Vec<usize>,
    /// The values of all rows.
    pub(crate) values: Values,
}

/// The values of a column.
pub(crate) enum Values {
    Floats(Vec<f32>),
    Doubles(Vec<f64>),
    Integers(Vec<i64>),
    Texts(Vec<String>),
}

/// A file that is written.
pub(crate) struct Table {
    path: PathBuf,
    writer: SerializedFileWriter<File>,
}

/// A row group that is written, column by column in the order of the schema.
pub(crate) struct RowGroup<'a> {
    path: &'a Path,
    writer: SerializedRowGroupWriter<'a, File>,
}

impl Table {
    /// Creates a file with columns as these, and after them columns of images.
    pub(crate) fn create(
        path: &Path,
        columns: &[Column],
        images: &[String],
        metadata: &[(&str, String)],
    ) -> anyhow::Result<Table> {
        let shown = || path.display().to_string();
        let fields = (columns.iter().map(Column::schema))
            .chain(images.iter().map(|name| image_schema(name)))
            .collect::<ParquetResult<_>>();
        let schema = || Type::group_type_builder("schema").with_fields(fields?).build();
        let entry = |(key, value): &(&str, String)| KeyValue::new((*key).to_owned(), value.clone());
        let mut properties = WriterProperties::builder()
            .set_writer_version(WriterVersion::PARQUET_1_0)
            .set_compression(Compression::UNCOMPRESSED)
            .set_dictionary_enabled(false)
            .set_statistics_enabled(EnabledStatistics::Chunk)
            .set_offset_index_disabled(true)
            .set_key_value_metadata(Some(metadata.iter().map(entry).collect()));
        for (image, part) in images.iter().flat_map(|image| [(image, "bytes"), (image, "path")]) {
            let column = ColumnPath::new(vec![image.clone(), part.to_owned()]);
            properties = properties.set_column_statistics_enabled(column, EnabledStatistics::None);
        }
        let file = File::create(path).with_context(shown)?;
        let writer = schema().and_then(|schema| {
            SerializedFileWriter::new(file, Arc::new(schema), Arc::new(properties.build()))
        });
        Ok(Table { path: path.to_owned(), writer: writer.with_context(shown)? })
    }

    /// Begins a row group.
    pub(crate) fn group(&mut self) -> anyhow::Result<RowGroup<'_>> {
        let writer = self.writer.next_row_group();
        Ok(RowGroup {
            path: &self.path,
            writer: writer.with_context(|| self.path.display().to_string())?,
        })
    }

    /// Returns the number of bytes so far.
    pub(crate) fn bytes(&self) -> u64 {
        self.writer.bytes_written() as u64
    }

    /// Ends the file.
    pub(crate) fn finish(self) -> anyhow::Result<()> {
        self.writer.close().with_context(|| self.path.display().to_string())?;
        Ok(())
    }
}

impl RowGroup<'_> {
    /// Writes the next column.
    pub(crate) fn put(&mut self, column: &Column) -> anyhow::Result<()> {
        let written = writing(|| self.try_put(column));
        written.with_context(|| self.path.display().to_string())
    }

    fn try_put(&mut self, column: &Column) -> ParquetResult<()> {
        let mut writer = self.next()?;
        let shape = &column.shape;
        match &column.values {
            Values::Floats(values) => write::<FloatType>(&mut writer, values, shape),
            Values::Doubles(values) => write::<DoubleType>(&mut writer, values, shape),
            Values::Integers(values) => write::<Int64Type>(&mut writer, values, shape),
            Values::Texts(values) => write::<ByteArrayType>(&mut writer, &texts(values), shape),
        }?;
        writer.close()
    }

    /// Writes the next column of images: those that `fill` passes on, each with its name.
    pub(crate) fn put_images(
        &mut self,
        fill: impl FnOnce(&mut dyn FnMut(Vec<u8>, String) -> anyhow::Result<()>) -> anyhow::Result<()>,
    ) -> anyhow::Result<()> {
        let path = self.path;
        let shown = || path.display().to_string();
        let mut files = self.next().with_context(shown)?;
        let mut names = Vec::new();
        fill(&mut |file, name| {
            names.push(name);
            let file = [ByteArray::from(file)];
            writing(|| write::<ByteArrayType>(&mut files, &file, &[])).with_context(shown)
        })?;
        writing(|| files.close()).with_context(shown)?;
        let mut paths = self.next().with_context(shown)?;
        write::<ByteArrayType>(&mut paths, &texts(&names), &[]).with_context(shown)?;
        paths.close().with_context(shown)
    }

    fn next(&mut self) -> ParquetResult<SerializedColumnWriter<'_>> {
        Ok(self.writer.next_column()?.expect("the schema has a column for each that is written"))
    }

    /// Ends the row group.
    pub(crate) fn finish(self) -> anyhow::Result<()> {
        self.writer.close().with_context(|| self.path.display().to_string())?;
        Ok(())
    }
}

impl Column {
    /// Returns the type of the column as other programs write it: everything may be absent.
    fn schema(&self) -> ParquetResult<TypePtr> {
        let physical = match self.values {
            Values::Floats(_) => Physical::FLOAT,
            Values::Doubles(_) => Physical::DOUBLE,
            Values::Integers(_) => Physical::INT64,
            Values::Texts(_) => Physical::BYTE_ARRAY,
        };
        let depth = self.shape.len();
        let name = |level: usize| if level == 0 { &self.name[..] } else { "element" };
        let mut made = leaf(name(depth), physical, matches!(self.values, Values::Texts(_)))?;
        for level in (0..depth).rev() {
            let list = Type::group_type_builder("list")
                .with_repetition(Repetition::REPEATED)
                .with_fields(vec![made])
                .build()?;
            let outer = Type::group_type_builder(name(level))
                .with_repetition(Repetition::OPTIONAL)
                .with_logical_type(Some(LogicalType::List))
                .with_converted_type(ConvertedType::LIST)
                .with_fields(vec![Arc::new(list)])
                .build()?;
            made = Arc::new(outer);
        }
        Ok(made)
    }
}

fn leaf(name: &str, physical: Physical, is_text: bool) -> ParquetResult<TypePtr> {
    let mut builder =
        Type::primitive_type_builder(name, physical).with_repetition(Repetition::OPTIONAL);
    if is_text {
        let text = Some(LogicalType::String);
        builder = builder.with_logical_type(text).with_converted_type(ConvertedType::UTF8);
    }
    Ok(Arc::new(builder.build()?))
}

/// Returns the type that the library `datasets` gives to images.
fn image_schema(name: &str) -> ParquetResult<TypePtr> {
    let parts = [("bytes", false), ("path", true)];
    let fields = parts.map(|(part, is_text)| leaf(part, Physical::BYTE_ARRAY, is_text));
    let group = Type::group_type_builder(name)
        .with_repetition(Repetition::OPTIONAL)
        .with_fields(fields.into_iter().collect::<ParquetResult<_>>()?);
    Ok(Arc::new(group.build()?))
}

fn texts(texts: &[String]) -> Vec<ByteArray> {
    texts.iter().map(|text| ByteArray::from(text.as_str())).collect()
}

/// Writes values of rows of this shape, none of which is absent.
fn write<T: DataType>(
    column: &mut SerializedColumnWriter,
    values: &[T::T],
    shape: &[usize],
) -> ParquetResult<()> {
    let writer = column.typed::<T>();
    let definition = vec![writer.get_descriptor().max_def_level(); values.len()];
    let repetition: Vec<i16> = (0..values.len()).map(|index| repetition(index, shape)).collect();
    writer.write_batch(values, Some(&definition), Some(&repetition))?;
    Ok(())
}

/// Returns the list that a value continues: 0 for the first of a row, 1 for the first of an element
/// of the outermost list, and so on.
fn repetition(index: usize, shape: &[usize]) -> i16 {
    let mut size = 1;
    let begun = shape.iter().rev().take_while(|len| {
        size *= **len;
        index.is_multiple_of(size)
    });
    (shape.len() - begun.count()) as i16
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The rule of <https://github.com/apache/parquet-format#nested-encoding>.
    #[test]
    fn a_value_repeats_the_innermost_list_that_it_continues() {
        let levels = |shape: &[usize]| (0..8).map(|i| repetition(i, shape)).collect::<Vec<_>>();
        assert_eq!(levels(&[]), [0; 8]);
        assert_eq!(levels(&[4]), [0, 1, 1, 1, 0, 1, 1, 1]);
        assert_eq!(levels(&[2, 2]), [0, 2, 1, 2, 0, 2, 1, 2]);
        assert_eq!(levels(&[4, 1, 1]), [0, 1, 1, 1, 0, 1, 1, 1]);
    }
}
