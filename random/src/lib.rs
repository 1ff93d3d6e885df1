//! Random numbers as a pure function of what they are for: nothing is carried from one use to the next.
//!
//! The one thing to know: a [`Stream`] is addressed by (seed, counter, purpose) and a stream number, and
//! yields the same words on every machine, however the work was shared out. [`Scrambled`] makes evenly spread
//! points of the unit square from three words of a stream; each single point is uniform, and point sets of
//! different keys are independent. [`Hashed`] makes independent ones.
//!
//! # Example
//! ```
//! use random::{Scrambled, Stream};
//!
//! let mut stream = Stream::new(7, 0, b"an example's own");
//! stream.go_to(3);
//! let points = Scrambled::from_stream(&mut stream);
//! // Four points, one in each quarter of either side.
//! let mut quarters: Vec<_> = (0..4).map(|index| (points.point(index).0 * 4.0) as usize).collect();
//! quarters.sort();
//! assert_eq!(quarters, [0, 1, 2, 3]);
//! ```

mod hashed;
mod sobol;
mod stream;

pub use hashed::Hashed;
pub use sobol::{Scrambled, ScrambledColumns};
pub use stream::{Stream, unit};
