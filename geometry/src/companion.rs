//! Real roots of a polynomial as eigenvalues of its companion matrix: the method to compare [`crate::bernstein`] with.
//!
//! The one thing to know: it answers the question of [`crate::bernstein::find_root`], "where in (0, 1) is this polynomial
//! zero", but it proves nothing. It finds all roots, real and complex ones, wherever they are, and then throws most of
//! them away; an eigenvalue is exact for a matrix that differs from the given one by rounding, so a pair of close real
//! roots may come out as a complex pair, or the other way round. It takes about ten times as long.
//!
//! # Source
//! The companion matrix as a root finder, and why it is balanced first: Edelman and Murakami, "Polynomial roots from
//! companion matrix eigenvalues", Mathematics of Computation 64 (1995). Balancing: Parlett and Reinsch, "Balancing a matrix
//! for calculation of eigenvalues and eigenvectors", Numerische Mathematik 13 (1969). Eigenvalues: Francis' implicit
//! double shift, as in Golub and Van Loan, "Matrix Computations", 4th ed., algorithms 7.5.1 and 7.5.2. Deviations: no search
//! for two small subdiagonal entries in a row, and an exceptional shift at every tenth step.

use crate::bernstein;
use crate::polynomial::DEGREE_MAX;

/// A leading coefficient below this part of the largest one is taken as 0: its root lies more than 1e13 intervals away.
const LEADING_MIN: f64 = 1e-13;

/// Steps for one eigenvalue; two or three are usual. What has not been found then is left out.
const STEPS_MAX: u32 = 60;

/// A method that finds roots along a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum RootFinder {
    /// Sign changes of Bernstein coefficients: [`bernstein::find_root`].
    #[default]
    Bernstein,
    /// Eigenvalues of the balanced companion matrix: [`find_root`].
    Companion,
}

/// The upper left part of it, as many rows as the degree, is in use.
type Matrix = [[f64; DEGREE_MAX]; DEGREE_MAX];

/// Passes the roots in the open interval `(0, 1)` of the polynomial with these Bernstein coefficients to `accept` in
/// ascending order and returns the first one for which it says true.
///
/// A root is a real eigenvalue of the companion matrix: a double root, which is none for [`bernstein::find_root`], may
/// come out as two equal roots or as none, as rounding decides. Coefficients that are not finite have no roots.
///
/// # Panics
///
/// If the degree is more than [`DEGREE_MAX`].
pub fn find_root<const N: usize>(
    coefficients: &[f64; N],
    mut accept: impl FnMut(f64) -> bool,
) -> Option<f64> {
    let (found, count) = real_roots(&bernstein::to_power(coefficients));
    let mut inside = [0.0; DEGREE_MAX];
    let mut inside_count = 0;
    for &root in found[..count].iter().filter(|&&root| root > 0.0 && root < 1.0) {
        inside[inside_count] = root;
        inside_count += 1;
    }
    let inside = &mut inside[..inside_count];
    inside.sort_unstable_by(f64::total_cmp);
    inside.iter().copied().find(|&root| accept(root))
}

/// All real roots, in no order, of a polynomial in powers of `x`, lowest first; and how many there are.
///
/// # Panics
///
/// If the degree is more than [`DEGREE_MAX`].
pub fn real_roots(power: &[f64]) -> ([f64; DEGREE_MAX], usize) {
    let mut roots = [0.0; DEGREE_MAX];
    let largest = power.iter().fold(0.0, |most, c| if c.abs() > most { c.abs() } else { most });
    let Some(degree) = power.iter().rposition(|c| c.abs() > LEADING_MIN * largest) else { return (roots, 0) };
    assert!(degree <= DEGREE_MAX, "degree {degree} is beyond {DEGREE_MAX}");
    if degree == 0 || power.iter().any(|c| !c.is_finite()) {
        return (roots, 0);
    }
    let mut matrix = [[0.0; DEGREE_MAX]; DEGREE_MAX];
    for i in 0..degree {
        matrix[0][i] = -power[degree - 1 - i] / power[degree];
        if i > 0 {
            matrix[i][i - 1] = 1.0;
        }
    }
    balance(&mut matrix, degree);
    let mut count = 0;
    real_eigenvalues(&mut matrix, degree, |root| {
        roots[count] = root;
        count += 1;
    });
    (roots, count)
}

/// Scales rows and columns by powers of two until the sums of absolute values beside the diagonal are about alike.
/// Exact: no eigenvalue changes.
fn balance(a: &mut Matrix, n: usize) {
    loop {
        let mut balanced = true;
        for i in 0..n {
            let (mut column, mut row) = (0.0, 0.0);
            for j in (0..n).filter(|&j| j != i) {
                column += a[j][i].abs();
                row += a[i][j].abs();
            }
            if !(column > 0.0 && row > 0.0) {
                continue;
            }
            let before = column + row;
            let mut factor = 1.0;
            while column < 0.5 * row {
                factor *= 2.0;
                column *= 4.0;
            }
            while column >= 2.0 * row {
                factor *= 0.5;
                column *= 0.25;
            }
            if (column + row) / factor < 0.95 * before {
                balanced = false;
                for entry in &mut a[i][..n] {
                    *entry /= factor;
                }
                for line in &mut a[..n] {
                    line[i] *= factor;
                }
            }
        }
        if balanced {
            return;
        }
    }
}

/// Passes the real eigenvalues of an upper Hessenberg matrix to `take`.
fn real_eigenvalues(a: &mut Matrix, n: usize, mut take: impl FnMut(f64)) {
    let size: f64 = a[..n].iter().flat_map(|row| &row[..n]).map(|entry| entry.abs()).sum();
    // Rows before `end` still have eigenvalues that are not known.
    let mut end = n;
    let mut steps = 0;
    while end > 0 {
        let start = block_start(a, end, size);
        match end - start {
            1 => take(a[start][start]),
            2 => real_pair(a, start, &mut take),
            _ if steps == STEPS_MAX => return,
            _ => {
                steps += 1;
                let (trace, determinant) = shifts(a, end, steps);
                francis_step(a, start, end, trace, determinant);
                continue;
            }
        }
        end = start;
        steps = 0;
    }
}

/// Where the last block begins whose subdiagonal entries are not small; the small entry before it becomes 0.
fn block_start(a: &mut Matrix, end: usize, size: f64) -> usize {
    for k in (1..end).rev() {
        let beside = a[k - 1][k - 1].abs() + a[k][k].abs();
        let beside = if beside == 0.0 { size } else { beside };
        if a[k][k - 1].abs() <= f64::EPSILON * beside {
            a[k][k - 1] = 0.0;
            return k;
        }
    }
    0
}

/// The eigenvalues of the 2x2 block from row `k`, if they are real.
fn real_pair(a: &Matrix, k: usize, take: &mut impl FnMut(f64)) {
    let half = 0.5 * (a[k][k] - a[k + 1][k + 1]);
    let product = a[k][k + 1] * a[k + 1][k];
    let discriminant = half * half + product;
    if !(discriminant >= 0.0) {
        return;
    }
    let root = discriminant.sqrt();
    let far = half + if half < 0.0 { -root } else { root };
    take(a[k + 1][k + 1] + far);
    take(a[k + 1][k + 1] - if far == 0.0 { 0.0 } else { product / far });
}

/// Sum and product of the two shifts: the eigenvalues of the last 2x2 block, but at every tenth step numbers of no
/// meaning, which end a cycle.
fn shifts(a: &Matrix, end: usize, step: u32) -> (f64, f64) {
    let (p, q) = (end - 2, end - 1);
    if step.is_multiple_of(10) {
        let size = a[q][p].abs() + a[p][p - 1].abs();
        return (1.5 * size, size * size);
    }
    (a[p][p] + a[q][q], a[p][p] * a[q][q] - a[p][q] * a[q][p])
}

/// One step of the QR algorithm with two shifts at once on the rows and columns from `start` to `end`: a reflection makes a
/// bulge below the subdiagonal, others chase it out.
fn francis_step(a: &mut Matrix, start: usize, end: usize, trace: f64, determinant: f64) {
    let (s, t) = (start, start + 1);
    // First column of (A - shift)(A - other shift).
    let mut x = a[s][s] * (a[s][s] - trace) + a[s][t] * a[t][s] + determinant;
    let mut y = a[t][s] * (a[s][s] + a[t][t] - trace);
    let mut z = a[t][s] * a[t + 1][t];
    for k in start..end - 1 {
        let length = if k + 2 < end { 3 } else { 2 };
        reflect(a, (start, end), k, &[x, y, z][..length]);
        if k + 2 < end {
            x = a[k + 1][k];
            y = a[k + 2][k];
            z = if k + 3 < end { a[k + 3][k] } else { 0.0 };
        }
    }
}

/// Reflects rows and columns from `k` so that `vector` turns onto its first axis.
fn reflect(a: &mut Matrix, (start, end): (usize, usize), k: usize, vector: &[f64]) {
    let largest = vector.iter().fold(0.0, |most, v| if v.abs() > most { v.abs() } else { most });
    if largest == 0.0 {
        return;
    }
    let length = vector.len();
    let mut v = [0.0; 3];
    for (own, given) in v.iter_mut().zip(vector) {
        *own = given / largest;
    }
    let norm = v.iter().map(|x| x * x).sum::<f64>().sqrt();
    v[0] += if v[0] < 0.0 { -norm } else { norm };
    let twice = 2.0 / v.iter().map(|x| x * x).sum::<f64>();
    let first = if k > start { k - 1 } else { start };
    let rows = &mut a[k..k + length];
    for column in first..end {
        let along: f64 = rows.iter().zip(&v).map(|(row, v)| v * row[column]).sum();
        for (row, v) in rows.iter_mut().zip(&v) {
            row[column] -= twice * along * v;
        }
    }
    let last = if k + 4 < end { k + 4 } else { end };
    for row in &mut a[start..last] {
        let along: f64 = (0..length).map(|i| v[i] * row[k + i]).sum();
        for i in 0..length {
            row[k + i] -= twice * along * v[i];
        }
    }
    if k > start {
        // Zero but for rounding.
        for i in 1..length {
            a[k + i][k - 1] = 0.0;
        }
    }
}
