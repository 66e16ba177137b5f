//! Solves with one right-hand side through the supernodes of a Cholesky factor, at the speed at which the factor can be
//! read.
//!
//! A supernode is a dense panel, column by column: a lower triangle and the rows below it. [`COLUMNS`] columns at a
//! time are read once, against a copy of the unknowns that the panel touches and that stays in cache. (The general
//! kernels of faer are made for many right-hand sides.)

use std::ops::{Add, Div, Neg, Sub};

use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;
use pulp::{Arch, Simd, WithSimd};

/// Columns of a panel that are read together.
const COLUMNS: usize = 4;
/// Partial sums of an inner product.
const LANES: usize = 8;

/// What a factor's numbers are.
pub(super) trait Number:
    Copy + Default + Add<Output = Self> + Sub<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// `self * a + b`, rounded once.
    fn fused(self, a: Self, b: Self) -> Self;
}

impl Number for f32 {
    #[inline(always)]
    fn fused(self, a: Self, b: Self) -> Self {
        self.mul_add(a, b)
    }
}

impl Number for f64 {
    #[inline(always)]
    fn fused(self, a: Self, b: Self) -> Self {
        self.mul_add(a, b)
    }
}

/// `x = (L L')^-1 x` in the order of elimination; `panel` is scratch.
pub(super) fn solve<T: Number>(
    symbolic: &SymbolicSupernodalCholesky<u32>,
    values: &[T],
    x: &mut [T],
    panel: &mut Vec<T>,
) {
    Arch::new().dispatch(Solve { symbolic, values, x, panel });
}

struct Solve<'a, T> {
    symbolic: &'a SymbolicSupernodalCholesky<u32>,
    values: &'a [T],
    x: &'a mut [T],
    panel: &'a mut Vec<T>,
}

impl<T: Number> WithSimd for Solve<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { symbolic, values, x, panel } = self;
        for s in 0..symbolic.n_supernodes() {
            forward(&Supernode::of(symbolic, values, s), x, panel);
        }
        for s in (0..symbolic.n_supernodes()).rev() {
            backward(&Supernode::of(symbolic, values, s), x, panel);
        }
    }
}

/// How far ahead of its use the factor is asked for, in bytes: columns are too short for the hardware to foresee.
const AHEAD: usize = 4096;

/// Asks for the bytes `AHEAD` behind (or before) some numbers that are about to be read.
#[inline(always)]
fn prefetch<T>(numbers: &[T], backwards: bool) {
    #[cfg(target_arch = "x86_64")]
    for line in (0..std::mem::size_of_val(numbers)).step_by(64) {
        let at = numbers.as_ptr().cast::<i8>().wrapping_add(line);
        let at = if backwards { at.wrapping_sub(AHEAD) } else { at.wrapping_add(AHEAD) };
        // Safety: a prefetch never faults, wherever it points.
        unsafe { std::arch::x86_64::_mm_prefetch(at, std::arch::x86_64::_MM_HINT_T0) };
    }
}

struct Supernode<'a, T> {
    begin: usize,
    width: usize,
    /// Unknowns of the rows below the triangle.
    below: &'a [u32],
    values: &'a [T],
}

impl<'a, T: Number> Supernode<'a, T> {
    #[inline(always)]
    fn of(symbolic: &'a SymbolicSupernodalCholesky<u32>, values: &'a [T], s: usize) -> Self {
        let begin = symbolic.supernode_begin()[s] as usize;
        let width = symbolic.supernode_end()[s] as usize - begin;
        let at = symbolic.col_ptr_for_val();
        let values = &values[at[s] as usize..at[s + 1] as usize];
        Self { begin, width, below: symbolic.supernode(s).pattern(), values }
    }

    /// All numbers of some columns.
    #[inline(always)]
    fn columns(&self, columns: std::ops::Range<usize>) -> &'a [T] {
        let rows = self.width + self.below.len();
        &self.values[rows * columns.start..rows * columns.end]
    }

    /// The part of a column from row `from` on.
    #[inline(always)]
    fn column(&self, column: usize, from: usize) -> &'a [T] {
        let rows = self.width + self.below.len();
        &self.values[rows * column + from..rows * (column + 1)]
    }
}

/// `x = L_s^-1 x` for the unknowns of a supernode, and what that means for the rows below.
#[inline(always)]
fn forward<T: Number>(node: &Supernode<T>, x: &mut [T], panel: &mut Vec<T>) {
    panel.clear();
    panel.extend_from_slice(&x[node.begin..node.begin + node.width]);
    panel.extend(node.below.iter().map(|&row| x[row as usize]));
    let mut at = 0;
    while at < node.width {
        let count = COLUMNS.min(node.width - at);
        prefetch(node.columns(at..at + count), false);
        for k in at..at + count {
            let column = node.column(k, k);
            let value = panel[k] / column[0];
            panel[k] = value;
            for (y, &l) in panel[k + 1..at + count].iter_mut().zip(&column[1..]) {
                *y = l.fused(-value, *y);
            }
        }
        let (solved, rest) = panel.split_at_mut(at + count);
        if count == COLUMNS {
            let column = |k| node.column(at + k, at + count);
            subtract(rest, [column(0), column(1), column(2), column(3)], &solved[at..]);
        } else {
            for (k, &value) in solved[at..].iter().enumerate() {
                for (y, &l) in rest.iter_mut().zip(node.column(at + k, at + count)) {
                    *y = l.fused(-value, *y);
                }
            }
        }
        at += count;
    }
    x[node.begin..node.begin + node.width].copy_from_slice(&panel[..node.width]);
    for (&row, &value) in node.below.iter().zip(&panel[node.width..]) {
        x[row as usize] = value;
    }
}

/// `x = L_s^-T x` for the unknowns of a supernode, the rows below being solved.
#[inline(always)]
fn backward<T: Number>(node: &Supernode<T>, x: &mut [T], panel: &mut Vec<T>) {
    panel.clear();
    panel.extend_from_slice(&x[node.begin..node.begin + node.width]);
    panel.extend(node.below.iter().map(|&row| x[row as usize]));
    let mut end = node.width;
    while end > 0 {
        // The incomplete block is the last one, as on the way forward.
        let at = (end - 1) / COLUMNS * COLUMNS;
        let count = end - at;
        prefetch(node.columns(at..end), true);
        let (head, rest) = panel.split_at_mut(end);
        if count == COLUMNS {
            let columns: [&[T]; COLUMNS] = std::array::from_fn(|k| &node.column(at + k, end)[..rest.len()]);
            let sums = products(columns, rest);
            (0..COLUMNS).for_each(|k| head[at + k] = head[at + k] - sums[k]);
        } else {
            for k in 0..count {
                let sum = products([node.column(at + k, end)], rest)[0];
                head[at + k] = head[at + k] - sum;
            }
        }
        for k in (at..end).rev() {
            let column = node.column(k, k);
            let mut value = head[k];
            for (&y, &l) in head[k + 1..end].iter().zip(&column[1..]) {
                value = l.fused(-y, value);
            }
            head[k] = value / column[0];
        }
        end = at;
    }
    x[node.begin..node.begin + node.width].copy_from_slice(&panel[..node.width]);
}

/// `y -= columns x`.
#[inline(always)]
fn subtract<T: Number>(y: &mut [T], [a, b, c, d]: [&[T]; COLUMNS], x: &[T]) {
    let (p, q, r, s) = (-x[0], -x[1], -x[2], -x[3]);
    for ((((y, &a), &b), &c), &d) in y.iter_mut().zip(a).zip(b).zip(c).zip(d) {
        *y = d.fused(s, c.fused(r, b.fused(q, a.fused(p, *y))));
    }
}

/// Inner products of columns with one vector.
#[inline(always)]
fn products<T: Number, const N: usize>(columns: [&[T]; N], y: &[T]) -> [T; N] {
    let mut sums = [[T::default(); LANES]; N];
    let whole = y.len() / LANES * LANES;
    for i in (0..whole).step_by(LANES) {
        let y: &[T; LANES] = y[i..i + LANES].try_into().expect("a whole chunk");
        for k in 0..N {
            let column: &[T; LANES] = columns[k][i..i + LANES].try_into().expect("a whole chunk");
            for l in 0..LANES {
                sums[k][l] = column[l].fused(y[l], sums[k][l]);
            }
        }
    }
    std::array::from_fn(|k| {
        let mut rest = T::default();
        for (&l, &y) in columns[k][whole..].iter().zip(&y[whole..]) {
            rest = l.fused(y, rest);
        }
        sums[k].iter().fold(rest, |sum, &part| sum + part)
    })
}
