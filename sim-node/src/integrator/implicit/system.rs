//! A sparse symmetric system of 6x6 blocks, one row of blocks for each body, and its solution by conjugate
//! gradients with the diagonal blocks' inverses as preconditioner. All sums run in a fixed order.

/// Force and torque, or linear and angular velocity.
pub(super) type Six = [f64; 6];
/// A 6x6 block, by rows.
pub(super) type Block = [Six; 6];

/// Part of the first residual, in the preconditioner's norm, at which the iteration ends.
const RESIDUAL: f64 = 1e-8;

/// The matrix: symmetric and positive definite.
#[derive(Debug, Default)]
pub(super) struct System {
    pub diagonal: Vec<Block>,
    /// Row, column and block; the transposed one is not listed.
    pub coupling: Vec<(u32, u32, Block)>,
}

/// Adds `weight a b^T`.
pub(super) fn add_outer(block: &mut Block, weight: f64, a: &Six, b: &Six) {
    for (row, &left) in block.iter_mut().zip(a) {
        let left = weight * left;
        row.iter_mut().zip(b).for_each(|(entry, &right)| *entry += left * right);
    }
}

pub(super) fn dot(a: &[Six], b: &[Six]) -> f64 {
    let mut sum = 0.0;
    for (a, b) in a.iter().zip(b) {
        for (x, y) in a.iter().zip(b) {
            sum += x * y;
        }
    }
    sum
}

fn times(block: &Block, x: &Six) -> Six {
    let mut product = [0.0; 6];
    for (entry, row) in product.iter_mut().zip(block) {
        for (a, b) in row.iter().zip(x) {
            *entry += a * b;
        }
    }
    product
}

fn times_transposed(block: &Block, x: &Six) -> Six {
    let mut product = [0.0; 6];
    for (row, factor) in block.iter().zip(x) {
        for (entry, a) in product.iter_mut().zip(row) {
            *entry += a * factor;
        }
    }
    product
}

fn add(sum: &mut Six, other: &Six, factor: f64) {
    sum.iter_mut().zip(other).for_each(|(a, b)| *a += factor * b);
}

/// The lower triangle of Cholesky's factor, with the inverses of its diagonal.
fn factor(block: &Block) -> Block {
    let mut lower = [[0.0; 6]; 6];
    for row in 0..6 {
        for column in 0..=row {
            let mut rest = block[row][column];
            for (left, above) in lower[row][..column].iter().zip(&lower[column]) {
                rest -= left * above;
            }
            lower[row][column] = if row == column { 1.0 / rest.sqrt() } else { rest * lower[column][column] };
        }
    }
    lower
}

fn solve_factored(lower: &Block, right: &Six) -> Six {
    let mut x = *right;
    for row in 0..6 {
        for inner in 0..row {
            x[row] -= lower[row][inner] * x[inner];
        }
        x[row] *= lower[row][row];
    }
    for row in (0..6).rev() {
        for inner in row + 1..6 {
            x[row] -= lower[inner][row] * x[inner];
        }
        x[row] *= lower[row][row];
    }
    x
}

impl System {
    fn times(&self, x: &[Six]) -> Vec<Six> {
        let mut product: Vec<Six> = self.diagonal.iter().zip(x).map(|(block, x)| times(block, x)).collect();
        for (row, column, block) in &self.coupling {
            let (row, column) = (*row as usize, *column as usize);
            add(&mut product[row], &times(block, &x[column]), 1.0);
            add(&mut product[column], &times_transposed(block, &x[row]), 1.0);
        }
        product
    }

    /// The solution, to [`RESIDUAL`] or as near as rounding lets it.
    pub(super) fn solve(&self, right: &[Six]) -> Vec<Six> {
        let factors: Vec<Block> = self.diagonal.iter().map(factor).collect();
        let precondition =
            |r: &[Six]| -> Vec<Six> { factors.iter().zip(r).map(|(f, r)| solve_factored(f, r)).collect() };
        let mut x = vec![[0.0; 6]; right.len()];
        let mut residual = right.to_vec();
        let mut z = precondition(&residual);
        let mut direction = z.clone();
        let mut size = dot(&residual, &z);
        let enough = RESIDUAL * RESIDUAL * size;
        // In exact arithmetic as many iterations as unknowns would do.
        for _ in 0..100 + 6 * right.len() {
            if !(size > enough) {
                break;
            }
            let image = self.times(&direction);
            let step = size / dot(&direction, &image);
            for (index, along) in direction.iter().enumerate() {
                add(&mut x[index], along, step);
                add(&mut residual[index], &image[index], -step);
            }
            z = precondition(&residual);
            let next = dot(&residual, &z);
            let keep = next / size;
            size = next;
            for (along, z) in direction.iter_mut().zip(&z) {
                for (a, z) in along.iter_mut().zip(z) {
                    *a = z + keep * *a;
                }
            }
        }
        x
    }
}

#[cfg(test)]
mod tests {
    use super::{System, add_outer, dot};

    /// Three bodies in a row, tied by stiff screws.
    #[test]
    fn a_stiff_chain_is_solved() {
        let mut unit = [[0.0; 6]; 6];
        (0..6).for_each(|i| unit[i][i] = 1.0 + i as f64);
        let mut system = System { diagonal: vec![unit; 3], coupling: Vec::new() };
        for (a, b) in [(0_u32, 1_u32), (1, 2)] {
            let (left, right) = ([0.0, 0.6, 0.8, 0.3, -0.4, 0.1], [0.0, 0.6, 0.8, -0.2, 0.5, 0.7]);
            add_outer(&mut system.diagonal[a as usize], 1e8, &left, &left);
            add_outer(&mut system.diagonal[b as usize], 1e8, &right, &right);
            let mut block = [[0.0; 6]; 6];
            add_outer(&mut block, -1e8, &left, &right);
            system.coupling.push((a, b, block));
        }
        let right = vec![[1.0, -2.0, 3.0, 0.5, 0.25, -1.0]; 3];
        let x = system.solve(&right);
        let mut rest = system.times(&x);
        for (rest, right) in rest.iter_mut().zip(&right) {
            rest.iter_mut().zip(right).for_each(|(a, b)| *a -= b);
        }
        let left = (dot(&rest, &rest) / dot(&right, &right)).sqrt();
        // Rounding of entries of 1e8 with a solution of the size of 1.
        println!("residual {left:e}, allowed 1e-6");
        assert!(left < 1e-6, "{left}");
    }
}
