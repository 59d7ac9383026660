//! Parquet files with one row group. A column is one page: a bit for each row that has a value, then these
//! values, neither encoded nor compressed. The numbers of fields are those in Parquet's Thrift definition.

use super::Cell;

const MAGIC: &[u8] = b"PAR1";

/// Types of fields in Thrift's compact protocol.
const I32: u8 = 5;
const I64: u8 = 6;
const BINARY: u8 = 8;
const LIST: u8 = 9;
const STRUCT: u8 = 12;

/// Values of Parquet's enumerations.
const VERSION: i64 = 1;
const OPTIONAL: i64 = 1;
const UTF8: i64 = 0;
const PLAIN: i64 = 0;
const RLE: i64 = 3;
const UNCOMPRESSED: i64 = 0;
const DATA_PAGE: i64 = 0;

/// Place of a column's page in the file.
struct Chunk {
    offset: usize,
    length: usize,
}

/// Returns the file of a table. Each column has `rows` cells.
pub fn file(columns: &[(String, Vec<Cell>)], rows: usize) -> Vec<u8> {
    let mut file = MAGIC.to_vec();
    let mut chunks = Vec::new();
    for (_, cells) in columns {
        let offset = file.len();
        let values = page(cells);
        file.extend(page_header(cells.len(), values.len()));
        file.extend(values);
        chunks.push(Chunk { offset, length: file.len() - offset });
    }
    let footer = footer(columns, &chunks, rows);
    file.extend(&footer);
    file.extend((footer.len() as u32).to_le_bytes());
    file.extend(MAGIC);
    file
}

/// Returns the bits of the cells with values, then the values.
fn page(cells: &[Cell]) -> Vec<u8> {
    let present: Vec<bool> = cells.iter().map(Cell::is_present).collect();
    // A bit-packed run begins with twice its number of bytes, plus one.
    let mut levels = Thrift::default();
    levels.varint(2 * present.len().div_ceil(8) as u64 + 1);
    levels.bytes.extend(bits(&present));
    let mut page = (levels.bytes.len() as u32).to_le_bytes().to_vec();
    page.extend(levels.bytes);
    let mut flags = Vec::new();
    for cell in cells {
        match cell {
            Cell::Text(Some(text)) => {
                page.extend((text.len() as u32).to_le_bytes());
                page.extend(text.as_bytes());
            }
            Cell::Flag(flag) => flags.push(*flag),
            Cell::Count(Some(count)) => page.extend(count.to_le_bytes()),
            Cell::Number(Some(number)) => page.extend(number.to_le_bytes()),
            Cell::Text(None) | Cell::Count(None) | Cell::Number(None) => {}
        }
    }
    page.extend(bits(&flags));
    page
}

/// Packs the flags into bytes, eight to a byte, the first in the lowest bit.
fn bits(flags: &[bool]) -> impl Iterator<Item = u8> {
    flags.chunks(8).map(|eight| eight.iter().rev().fold(0, |byte, flag| byte << 1 | u8::from(*flag)))
}

impl Cell {
    fn is_present(&self) -> bool {
        !matches!(self, Cell::Text(None) | Cell::Count(None) | Cell::Number(None))
    }

    /// Returns the number of the type in Parquet.
    fn physical_type(&self) -> i64 {
        match self {
            Cell::Flag(_) => 0,
            Cell::Count(_) => 2,
            Cell::Number(_) => 5,
            Cell::Text(_) => 6,
        }
    }
}

/// Returns a `PageHeader`.
fn page_header(cells: usize, length: usize) -> Vec<u8> {
    let mut header = Thrift::default();
    header.number(1, I32, DATA_PAGE);
    header.number(2, I32, length as i64);
    header.number(3, I32, length as i64);
    header.within(5, |data| {
        data.number(1, I32, cells as i64);
        data.number(2, I32, PLAIN);
        data.number(3, I32, RLE);
        data.number(4, I32, RLE);
    });
    header.end()
}

/// Returns the `FileMetaData`.
fn footer(columns: &[(String, Vec<Cell>)], chunks: &[Chunk], rows: usize) -> Vec<u8> {
    let mut footer = Thrift::default();
    footer.number(1, I32, VERSION);
    footer.list(2, STRUCT, columns.len() + 1);
    footer.element(|root| {
        root.text(4, "episodes");
        root.number(5, I32, columns.len() as i64);
    });
    for (name, cells) in columns {
        footer.element(|column| schema(column, name, cells));
    }
    footer.number(3, I64, rows as i64);
    footer.list(4, STRUCT, 1);
    footer.element(|group| {
        group.list(1, STRUCT, columns.len());
        for ((name, cells), chunk) in columns.iter().zip(chunks) {
            group.element(|column| {
                column.number(2, I64, chunk.offset as i64);
                column.within(3, |data| column_data(data, name, cells, chunk));
            });
        }
        group.number(2, I64, chunks.iter().map(|chunk| chunk.length as i64).sum());
        group.number(3, I64, rows as i64);
    });
    footer.text(6, "tandem");
    footer.end()
}

/// Writes the fields of a `SchemaElement`.
fn schema(column: &mut Thrift, name: &str, cells: &[Cell]) {
    column.number(1, I32, cells.first().map_or(0, Cell::physical_type));
    column.number(3, I32, OPTIONAL);
    column.text(4, name);
    if let Some(Cell::Text(_)) = cells.first() {
        column.number(6, I32, UTF8);
    }
}

/// Writes the fields of a `ColumnMetaData`.
fn column_data(data: &mut Thrift, name: &str, cells: &[Cell], chunk: &Chunk) {
    data.number(1, I32, cells.first().map_or(0, Cell::physical_type));
    data.list(2, I32, 2);
    data.zigzag(PLAIN);
    data.zigzag(RLE);
    data.list(3, BINARY, 1);
    data.binary(name);
    data.number(4, I32, UNCOMPRESSED);
    data.number(5, I64, cells.len() as i64);
    data.number(6, I64, chunk.length as i64);
    data.number(7, I64, chunk.length as i64);
    data.number(9, I64, chunk.offset as i64);
}

/// Writer of a structure in Thrift's compact protocol. Fields are written in the order of their numbers.
#[derive(Default)]
struct Thrift {
    bytes: Vec<u8>,
    last_field: u8,
}

impl Thrift {
    /// Begins a field.
    fn field(&mut self, number: u8, kind: u8) {
        self.bytes.push((number - self.last_field) << 4 | kind);
        self.last_field = number;
    }

    fn number(&mut self, number: u8, kind: u8, value: i64) {
        self.field(number, kind);
        self.zigzag(value);
    }

    fn text(&mut self, number: u8, text: &str) {
        self.field(number, BINARY);
        self.binary(text);
    }

    fn within(&mut self, number: u8, write: impl FnOnce(&mut Thrift)) {
        self.field(number, STRUCT);
        self.element(write);
    }

    /// Begins a list; its elements follow.
    fn list(&mut self, number: u8, kind: u8, length: usize) {
        self.field(number, LIST);
        match length {
            0..15 => self.bytes.push((length as u8) << 4 | kind),
            _ => {
                self.bytes.push(0xf0 | kind);
                self.varint(length as u64);
            }
        }
    }

    /// Writes a structure that is an element of a list.
    fn element(&mut self, write: impl FnOnce(&mut Thrift)) {
        let outer = std::mem::take(&mut self.last_field);
        write(self);
        self.bytes.push(0);
        self.last_field = outer;
    }

    fn binary(&mut self, text: &str) {
        self.varint(text.len() as u64);
        self.bytes.extend(text.as_bytes());
    }

    fn zigzag(&mut self, value: i64) {
        self.varint((value << 1 ^ value >> 63) as u64);
    }

    fn varint(&mut self, mut value: u64) {
        while value >= 0x80 {
            self.bytes.push(value as u8 | 0x80);
            value >>= 7;
        }
        self.bytes.push(value as u8);
    }

    /// Ends the structure.
    fn end(mut self) -> Vec<u8> {
        self.bytes.push(0);
        self.bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// pyarrow has read exactly these bytes and found this table.
    #[test]
    fn a_table_is_the_known_file() {
        let texts = (0..9).map(|row| Cell::Text((row % 3 != 1).then(|| format!("é{row}")))).collect();
        let flags = (0..9).map(|row| Cell::Flag(row % 2 == 0)).collect();
        let counts = (0..9u64).map(|row| Cell::Count((row != 4).then_some(row << 32))).collect();
        let numbers = (0..9u8).map(|row| Cell::Number((row > 6).then_some(f64::from(row) / 4.0))).collect();
        let mut columns: Vec<(String, Vec<Cell>)> =
            vec![("text".into(), texts), ("flag".into(), flags), ("count".into(), counts)];
        // More columns than fit the short form of a list.
        columns.extend(
            (0..13).map(|index| (format!("empty{index}"), (0..9).map(|_| Cell::Number(None)).collect())),
        );
        columns.push(("number".into(), numbers));
        assert!(file(&columns, 9) == include_bytes!("known.parquet"));
    }
}
