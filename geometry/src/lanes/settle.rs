//! The arcs that a search has found, in the order of its pairs.

use super::{ArcSearch, LaneArc};

impl ArcSearch {
    /// The pairs that touch, in order: the number of each among those searched, and its arcs; those of an irregular
    /// pair, which may touch or not, are none.
    pub fn touching(&self) -> Touching<'_> {
        Touching { arcs: &self.arcs, irregular: &self.irregular }
    }

    /// Brings the arcs into the order of the pairs; the order of a pair's two is a function of that pair alone. A pair
    /// that is irregular on one side is irregular as a whole.
    pub(super) fn settle(&mut self) {
        self.irregular.sort_unstable();
        self.irregular.dedup();
        let [simple, parts, late, _] = &mut self.found;
        insert(parts, late);
        // Behind each list one that is behind all, so that no end needs a look.
        let last = LaneArc { numbers: [0.0, 0.0, 0.0, f64::MAX] };
        let count = simple.len() + parts.len();
        simple.push(last);
        parts.push(last);
        if self.arcs.len() < count {
            self.arcs.resize(count, last);
        }
        self.arcs.truncate(count);
        let (mut one, mut other) = (0, 0);
        for arc in &mut self.arcs {
            // Of one pair's two, from one list each, the one with the smaller rule goes first.
            let first = simple[one].numbers[3] <= parts[other].numbers[3];
            *arc = if first { simple[one] } else { parts[other] };
            one += usize::from(first);
            other += usize::from(!first);
        }
        if !self.irregular.is_empty() {
            // Both lists are in order.
            let mut irregular = self.irregular.iter().map(|&pair| pair as usize).peekable();
            self.arcs.retain(|arc| {
                while irregular.next_if(|&pair| pair < arc.pair()).is_some() {}
                irregular.peek() != Some(&arc.pair())
            });
        }
    }
}

/// Inserts a few arcs in any order into many in the order of the pairs, each after those of its pair.
fn insert(many: &mut Vec<LaneArc>, few: &mut [LaneArc]) {
    few.sort_by_key(LaneArc::pair);
    let mut end = many.len();
    many.extend_from_slice(few);
    // From the last on, so that each arc moves once.
    for (before, arc) in few.iter().enumerate().rev() {
        let at = many[..end].partition_point(|other| other.pair() <= arc.pair());
        many.copy_within(at..end, at + before + 1);
        many[at + before] = *arc;
        end = at;
    }
}

/// See [`ArcSearch::touching`].
#[derive(Clone, Debug)]
pub struct Touching<'a> {
    arcs: &'a [LaneArc],
    irregular: &'a [u32],
}

impl<'a> Iterator for Touching<'a> {
    type Item = (usize, &'a [LaneArc]);

    #[inline]
    fn next(&mut self) -> Option<(usize, &'a [LaneArc])> {
        let regular = self.arcs.first().map(LaneArc::pair);
        if let Some((&irregular, rest)) = self.irregular.split_first()
            && regular.is_none_or(|regular| (irregular as usize) < regular)
        {
            self.irregular = rest;
            return Some((irregular as usize, &[]));
        }
        let pair = regular?;
        let (arcs, rest) = self.arcs.split_at(self.arcs.iter().take_while(|arc| arc.pair() == pair).count());
        self.arcs = rest;
        Some((pair, arcs))
    }
}

#[cfg(test)]
mod tests {
    use super::{LaneArc, insert};

    #[test]
    fn arcs_that_come_late_find_their_places() {
        let arc = |(pair, number): (usize, usize)| LaneArc {
            numbers: [number as f64, 0.0, 0.0, (4 * pair) as f64],
        };
        let numbers = |arcs: &[LaneArc]| {
            arcs.iter().map(|arc| (arc.pair(), arc.numbers[0] as usize)).collect::<Vec<_>>()
        };
        let many = [(2, 0), (3, 1), (3, 2), (7, 3)];
        let few = [(3, 10), (1, 11), (9, 12), (3, 13), (7, 14)];
        let mut arcs: Vec<LaneArc> = many.into_iter().map(arc).collect();
        insert(&mut arcs, &mut few.map(arc));
        let mut expected = [&many[..], &few[..]].concat();
        expected.sort_by_key(|&(pair, _)| pair);
        assert_eq!(numbers(&arcs), expected);
    }
}
