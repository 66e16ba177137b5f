//! Numbers and lines of a mesh file, text or binary, and where they are. Nothing is read twice and nothing is kept.

use std::io::{self, BufRead, Seek};

use super::error::{Place, Problem};

/// More bytes than any number or section name has.
const LONGEST_TOKEN: usize = 64;
/// Bytes of a line that are kept: a name may have 127 characters.
const LONGEST_LINE: usize = 1024;

/// A mesh file while it is read.
pub(super) struct Source<R> {
    input: R,
    /// Bytes of the whole file.
    pub length: u64,
    /// Whether numbers are binary.
    pub binary: bool,
    line: u64,
    /// Bytes that were read.
    pub byte: u64,
    token: Vec<u8>,
    item: Item,
}

/// What is being read, for messages about files that end too early.
#[derive(Clone, Copy)]
struct Item {
    section: &'static str,
    items: &'static str,
    done: u64,
    announced: u64,
}

type Result<T> = std::result::Result<T, Problem>;

impl<R: BufRead> Source<R> {
    pub fn new(input: R, length: u64) -> Self {
        let item = Item { section: "MeshFormat", items: "numbers", done: 0, announced: 3 };
        Self { input, length, binary: false, line: 1, byte: 0, token: Vec::new(), item }
    }

    pub fn place(&self) -> Place {
        if self.binary { Place::Byte(self.byte) } else { Place::Line(self.line) }
    }

    /// Says what follows: so many items of at least `bytes` bytes each.
    ///
    /// # Errors
    /// If the file cannot hold them.
    pub fn announce(&mut self, section: &'static str, items: &'static str, announced: u64, bytes: u64) -> Result<()> {
        self.item = Item { section, items, done: 0, announced };
        let rest = self.length.saturating_sub(self.byte);
        if announced > rest / bytes {
            let limit = format!("the {rest} bytes that follow can hold: save the file again");
            return Err(Problem::TooMany { section, items, announced, limit });
        }
        Ok(())
    }

    /// One more item is read.
    pub fn done(&mut self) {
        self.item.done += 1;
    }

    /// The file ends before what was announced is complete.
    pub fn cut_short(&self) -> Problem {
        let Item { section, items, done, announced } = self.item;
        Problem::CutShort { section, items, done, announced }
    }

    /// Where the next line begins, and its text without blanks around it, cut to 1024 bytes; `None` at the end of the
    /// file.
    pub fn line(&mut self) -> Result<Option<(Place, Vec<u8>)>> {
        let place = self.place();
        let mut line = Vec::new();
        let mut any = false;
        loop {
            let buffer = self.input.fill_buf()?;
            if buffer.is_empty() {
                break;
            }
            any = true;
            let end = buffer.iter().position(|&b| b == b'\n');
            let text = &buffer[..end.unwrap_or(buffer.len())];
            line.extend(&text[..text.len().min(LONGEST_LINE - line.len())]);
            let used = text.len() + usize::from(end.is_some());
            self.input.consume(used);
            self.byte += used as u64;
            if end.is_some() {
                self.line += 1;
                break;
            }
        }
        Ok(any.then(|| (place, line.trim_ascii().to_vec())))
    }

    /// The next line that is not empty.
    pub fn filled_line(&mut self) -> Result<Option<(Place, Vec<u8>)>> {
        loop {
            match self.line()? {
                Some((_, line)) if line.is_empty() => {}
                line => return Ok(line),
            }
        }
    }

    /// Reads on until a section ends; whether it does.
    pub fn skip_to(&mut self, end: &str) -> Result<bool> {
        while let Some((_, line)) = self.line()? {
            if line == end.as_bytes() {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// The line that ends a section.
    pub fn end(&mut self, end: &'static str) -> Result<()> {
        match self.filled_line()? {
            Some((_, line)) if line == end.as_bytes() => Ok(()),
            Some((place, line)) => Err(Problem::expected(place, end, &line)),
            None => Err(self.cut_short()),
        }
    }

    /// Skips the rest of a line of text.
    pub fn finish_line(&mut self) -> Result<()> {
        self.line().map(drop)
    }

    /// An integer of 32 bits: a tag of the geometry, a type, a flag.
    pub fn int(&mut self, expected: &'static str) -> Result<i32> {
        if self.binary { self.bytes().map(i32::from_ne_bytes) } else { self.text(expected) }
    }

    /// A count or a number of a node or cell.
    pub fn size(&mut self, expected: &'static str) -> Result<u64> {
        if self.binary { self.bytes().map(u64::from_ne_bytes) } else { self.text(expected) }
    }

    /// As [`Source::size`], where binary files of version 2 have 32 bits.
    pub fn short_size(&mut self, expected: &'static str) -> Result<u64> {
        if self.binary { self.bytes().map(|b| u32::from_ne_bytes(b).into()) } else { self.text(expected) }
    }

    /// A real number.
    pub fn real(&mut self, expected: &'static str) -> Result<f64> {
        if self.binary { self.bytes().map(f64::from_ne_bytes) } else { self.text(expected) }
    }

    fn bytes<const N: usize>(&mut self) -> Result<[u8; N]> {
        let mut bytes = [0; N];
        match self.input.read_exact(&mut bytes) {
            Ok(()) => {
                self.byte += N as u64;
                Ok(bytes)
            }
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Err(self.cut_short()),
            Err(error) => Err(error.into()),
        }
    }

    /// The next word of a text as a number.
    pub fn text<T: std::str::FromStr>(&mut self, expected: &'static str) -> Result<T> {
        self.token.clear();
        'words: loop {
            let buffer = self.input.fill_buf()?;
            if buffer.is_empty() {
                break;
            }
            let mut used = 0;
            for &byte in buffer {
                if !byte.is_ascii_whitespace() {
                    if self.token.len() < LONGEST_TOKEN {
                        self.token.push(byte);
                    }
                } else if !self.token.is_empty() {
                    self.input.consume(used);
                    self.byte += used as u64;
                    break 'words;
                } else if byte == b'\n' {
                    self.line += 1;
                }
                used += 1;
            }
            self.input.consume(used);
            self.byte += used as u64;
        }
        if self.token.is_empty() {
            return Err(self.cut_short());
        }
        if self.token.starts_with(b"$End") {
            let Item { section, items, done, announced } = self.item;
            return Err(Problem::Count { section, items, announced, found: done });
        }
        let number = std::str::from_utf8(&self.token).ok().and_then(|word| word.parse().ok());
        number.ok_or_else(|| Problem::expected(self.place(), expected, &self.token))
    }
}

impl<R: BufRead + Seek> Source<R> {
    /// Goes past so many items of so many bytes each, which count as read if they are those announced.
    ///
    /// # Errors
    /// If the file ends before.
    pub fn pass(&mut self, items: u64, bytes: u64, are_announced: bool) -> Result<()> {
        let there = self.length.saturating_sub(self.byte) / bytes;
        if are_announced {
            self.item.done += items.min(there);
        }
        if there < items {
            return Err(self.cut_short());
        }
        self.input.seek_relative((items * bytes) as i64)?;
        self.byte += items * bytes;
        Ok(())
    }
}
