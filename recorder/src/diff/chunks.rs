//! Which chunks of two logs hold the same records, so that nobody has to look at the messages in them.

use super::Side;
use crate::message::Kind;
use std::cell::RefCell;

/// How far sameness is looked into.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Depth {
    /// As chunks claim it by their length and checksum: that reads nothing that opening a log has not read.
    Claims,
    /// Byte for byte, and the checksums are compared with the bytes.
    Bytes,
}

/// What is known of the chunks of two logs.
pub(super) struct Chunks<'a, 'b> {
    sides: &'a [Side<'b>; 2],
    depth: Depth,
    /// Of each chunk of the first log: the chunk of the second that it was last compared with, and the result.
    known: RefCell<Vec<Option<(usize, bool)>>>,
}

impl<'a, 'b> Chunks<'a, 'b> {
    pub fn new(sides: &'a [Side<'b>; 2], depth: Depth) -> Chunks<'a, 'b> {
        let (_, count) = sides[0].log.chunks_checked();
        Chunks { sides, depth, known: RefCell::new(vec![None; count]) }
    }

    pub fn depth(&self) -> Depth {
        self.depth
    }

    /// Whether two messages lie at the same place of chunks that are the same, and so are the same themselves.
    /// `false` says nothing: then the messages are to be compared.
    pub fn hold_the_same(&self, kind: Kind, indexes: [usize; 2]) -> bool {
        let [Some((chunk_a, at_a)), Some((chunk_b, at_b))] =
            [0, 1].map(|side| self.sides[side].log.place(kind, indexes[side]))
        else {
            return false;
        };
        if at_a != at_b {
            return false;
        }
        if let Some((with, same)) = self.known.borrow()[chunk_a]
            && with == chunk_b
        {
            return same;
        }
        let same = self.are_the_same(chunk_a, chunk_b);
        self.known.borrow_mut()[chunk_a] = Some((chunk_b, same));
        same
    }

    fn are_the_same(&self, a: usize, b: usize) -> bool {
        let [side_a, side_b] = self.sides;
        let ((bytes_a, crc_a), (bytes_b, crc_b)) = (side_a.log.chunk(a), side_b.log.chunk(b));
        // A checksum of 0 may mean that there is none.
        if bytes_a.len() != bytes_b.len() || crc_a != crc_b || crc_a == 0 {
            return false;
        }
        if self.depth == Depth::Claims {
            return true;
        }
        if bytes_a != bytes_b {
            return false;
        }
        // The same bytes under the same checksum: if one chunk is as it was written, so is the other.
        if let Err(error) = side_a.log.check_chunk(a) {
            side_a.note(error.to_string());
            if let Err(error) = side_b.log.check_chunk(b) {
                side_b.note(error.to_string());
            }
        }
        true
    }
}
