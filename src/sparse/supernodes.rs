//! Solves with one right-hand side, or with [`WIDTH`], through the supernodes of a Cholesky factor, at the speed at which
//! the factor can be read.
//!
//! A supernode is a dense panel, column by column: a lower triangle and the rows below it. [`COLUMNS`] columns at a
//! time are read once, against a copy of the unknowns that the panel touches and that stays in cache. Of several
//! right-hand sides each does exactly what it would do beside any others. (The general kernels of faer are made for
//! many right-hand sides.)

use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;
use pulp::{Arch, Simd, WithSimd};

pub(super) mod fronts;

use super::number::{Number, WIDTH, Wide};

/// Columns of a panel that are read together.
const COLUMNS: usize = 4;

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
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { symbolic, values, x, panel } = self;
        for s in 0..symbolic.n_supernodes() {
            forward(simd, &Supernode::of(symbolic, values, s), x, panel);
        }
        for s in (0..symbolic.n_supernodes()).rev() {
            backward(simd, &Supernode::of(symbolic, values, s), x, panel);
        }
    }
}

/// `x = (L L')^-1 x` for several right-hand sides, unknown by unknown; `panel` is scratch.
pub(super) fn solve_wide<T: Number>(
    symbolic: &SymbolicSupernodalCholesky<u32>,
    values: &[T],
    x: &mut [Wide<T>],
    panel: &mut Vec<Wide<T>>,
) {
    Arch::new().dispatch(SolveWide { symbolic, values, x, panel });
}

struct SolveWide<'a, T> {
    symbolic: &'a SymbolicSupernodalCholesky<u32>,
    values: &'a [T],
    x: &'a mut [Wide<T>],
    panel: &'a mut Vec<Wide<T>>,
}

impl<T: Number> WithSimd for SolveWide<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { symbolic, values, x, panel } = self;
        for s in 0..symbolic.n_supernodes() {
            forward_wide(simd, &Supernode::of(symbolic, values, s), x, panel);
        }
        for s in (0..symbolic.n_supernodes()).rev() {
            backward_wide(simd, &Supernode::of(symbolic, values, s), x, panel);
        }
    }
}

/// Entries of the factor in a supernode: those of the triangle, and of the rows below it.
pub(super) fn entries(symbolic: &SymbolicSupernodalCholesky<u32>, s: usize) -> usize {
    let width = (symbolic.supernode_end()[s] - symbolic.supernode_begin()[s]) as usize;
    width * (width + 1) / 2 + width * symbolic.supernode(s).pattern().len()
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
fn forward<T: Number, S: Simd>(simd: S, node: &Supernode<T>, x: &mut [T], panel: &mut Vec<T>) {
    panel.clear();
    panel.extend_from_slice(&x[node.begin..node.begin + node.width]);
    panel.extend(node.below.iter().map(|&row| x[row as usize]));
    eliminate(simd, node, panel);
    x[node.begin..node.begin + node.width].copy_from_slice(&panel[..node.width]);
    for (&row, &value) in node.below.iter().zip(&panel[node.width..]) {
        x[row as usize] = value;
    }
}

/// As [`forward`], in the unknowns that the supernode touches.
#[inline(always)]
fn eliminate<T: Number, S: Simd>(simd: S, node: &Supernode<T>, panel: &mut [T]) {
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
            subtract(simd, rest, [column(0), column(1), column(2), column(3)], &solved[at..]);
        } else {
            for (k, &value) in solved[at..].iter().enumerate() {
                for (y, &l) in rest.iter_mut().zip(node.column(at + k, at + count)) {
                    *y = l.fused(-value, *y);
                }
            }
        }
        at += count;
    }
}

/// `x = L_s^-T x` for the unknowns of a supernode, the rows below being solved.
#[inline(always)]
fn backward<T: Number, S: Simd>(simd: S, node: &Supernode<T>, x: &mut [T], panel: &mut Vec<T>) {
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
            let sums = products(simd, columns, rest);
            (0..COLUMNS).for_each(|k| head[at + k] = head[at + k] - sums[k]);
        } else {
            for k in 0..count {
                let sum = products(simd, [node.column(at + k, end)], rest)[0];
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
fn subtract<T: Number, S: Simd>(simd: S, y: &mut [T], columns: [&[T]; COLUMNS], x: &[T]) {
    let whole = y.len() / WIDTH * WIDTH;
    let (chunks, rest) = y.as_chunks_mut::<WIDTH>();
    let [a, b, c, d] = columns.map(|column| column[..whole].as_chunks::<WIDTH>().0);
    let x: [T; COLUMNS] = std::array::from_fn(|k| -x[k]);
    let [p, q, r, s] = x.map(|x| x.all(simd));
    for ((((y, a), b), c), d) in chunks.iter_mut().zip(a).zip(b).zip(c).zip(d) {
        let [a, b, c, d] = [a, b, c, d].map(T::parts::<S>);
        for (v, y) in T::parts_mut::<S>(y).iter_mut().enumerate() {
            let sum = T::add_product(simd, b[v], q, T::add_product(simd, a[v], p, *y));
            *y = T::add_product(simd, d[v], s, T::add_product(simd, c[v], r, sum));
        }
    }
    for (i, y) in rest.iter_mut().enumerate() {
        *y = (0..COLUMNS).fold(*y, |y, k| columns[k][whole + i].fused(x[k], y));
    }
}

/// Inner products of columns with one vector.
#[inline(always)]
fn products<T: Number, S: Simd, const N: usize>(simd: S, columns: [&[T]; N], y: &[T]) -> [T; N] {
    let mut sums = [[T::default(); WIDTH]; N];
    let (chunks, rest) = y.as_chunks::<WIDTH>();
    let whole = y.len() - rest.len();
    let of_columns = columns.map(|column| column[..whole].as_chunks::<WIDTH>().0);
    for v in 0..T::parts::<S>(&sums[0]).len() {
        let mut sum = sums.each_ref().map(|sum| T::parts::<S>(sum)[v]);
        for (i, y) in chunks.iter().enumerate() {
            let y = T::parts::<S>(y)[v];
            for k in 0..N {
                sum[k] = T::add_product(simd, T::parts::<S>(&of_columns[k][i])[v], y, sum[k]);
            }
        }
        (0..N).for_each(|k| T::parts_mut::<S>(&mut sums[k])[v] = sum[k]);
    }
    std::array::from_fn(|k| {
        let rest = columns[k][whole..].iter().zip(rest).fold(T::default(), |sum, (&l, &y)| l.fused(y, sum));
        sums[k].iter().fold(rest, |sum, &part| sum + part)
    })
}

/// As [`forward`].
#[inline(always)]
fn forward_wide<T: Number, S: Simd>(simd: S, node: &Supernode<T>, x: &mut [Wide<T>], panel: &mut Vec<Wide<T>>) {
    panel.clear();
    panel.extend_from_slice(&x[node.begin..node.begin + node.width]);
    panel.extend(node.below.iter().map(|&row| x[row as usize]));
    let mut at = 0;
    while at < node.width {
        let count = COLUMNS.min(node.width - at);
        for k in at..at + count {
            let column = node.column(k, k);
            panel[k] = panel[k].map(|x| x / column[0]);
            let minus = panel[k].map(|v| -v);
            for (y, &l) in panel[k + 1..at + count].iter_mut().zip(&column[1..]) {
                add(simd, l, &minus, y);
            }
        }
        let (solved, rest) = panel.split_at_mut(at + count);
        let column = |k| node.column(at + k, at + count);
        if count == COLUMNS {
            let minus: [Wide<T>; COLUMNS] = std::array::from_fn(|k| solved[at + k].map(|v| -v));
            let [p, q, r, s] = minus.each_ref().map(T::parts::<S>);
            for ((((y, &a), &b), &c), &d) in rest.iter_mut().zip(column(0)).zip(column(1)).zip(column(2)).zip(column(3))
            {
                for (v, y) in T::parts_mut::<S>(y).iter_mut().enumerate() {
                    let sum = T::add_product(simd, b.all(simd), q[v], T::add_product(simd, a.all(simd), p[v], *y));
                    *y = T::add_product(simd, d.all(simd), s[v], T::add_product(simd, c.all(simd), r[v], sum));
                }
            }
        } else {
            for (k, value) in solved[at..].iter().enumerate() {
                let minus = value.map(|v| -v);
                rest.iter_mut().zip(column(k)).for_each(|(y, &l)| add(simd, l, &minus, y));
            }
        }
        at += count;
    }
    x[node.begin..node.begin + node.width].copy_from_slice(&panel[..node.width]);
    for (&row, value) in node.below.iter().zip(&panel[node.width..]) {
        x[row as usize] = *value;
    }
}

/// As [`backward`].
#[inline(always)]
fn backward_wide<T: Number, S: Simd>(simd: S, node: &Supernode<T>, x: &mut [Wide<T>], panel: &mut Vec<Wide<T>>) {
    panel.clear();
    panel.extend_from_slice(&x[node.begin..node.begin + node.width]);
    panel.extend(node.below.iter().map(|&row| x[row as usize]));
    let mut end = node.width;
    while end > 0 {
        let at = (end - 1) / COLUMNS * COLUMNS;
        let count = end - at;
        let (head, rest) = panel.split_at_mut(end);
        let column = |k| node.column(at + k, end);
        let mut sums = [[T::default(); WIDTH]; COLUMNS];
        if count == COLUMNS {
            let [p, q, r, s] = sums.each_mut().map(T::parts_mut::<S>);
            for v in 0..p.len() {
                let (mut e, mut f, mut g, mut h) = (p[v], q[v], r[v], s[v]);
                for ((((y, &a), &b), &c), &d) in rest.iter().zip(column(0)).zip(column(1)).zip(column(2)).zip(column(3))
                {
                    let y = T::parts::<S>(y)[v];
                    e = T::add_product(simd, a.all(simd), y, e);
                    f = T::add_product(simd, b.all(simd), y, f);
                    g = T::add_product(simd, c.all(simd), y, g);
                    h = T::add_product(simd, d.all(simd), y, h);
                }
                (p[v], q[v], r[v], s[v]) = (e, f, g, h);
            }
        } else {
            for (k, sum) in sums[..count].iter_mut().enumerate() {
                rest.iter().zip(column(k)).for_each(|(y, &l)| add(simd, l, y, sum));
            }
        }
        for (k, sum) in sums[..count].iter().enumerate() {
            head[at + k] = std::array::from_fn(|l| head[at + k][l] - sum[l]);
        }
        for k in (at..end).rev() {
            let column = node.column(k, k);
            let (value, others) = head[k..end].split_first_mut().expect("it is before the end");
            others.iter().zip(&column[1..]).for_each(|(y, &l)| add(simd, -l, y, value));
            *value = value.map(|v| v / column[0]);
        }
        end = at;
    }
    x[node.begin..node.begin + node.width].copy_from_slice(&panel[..node.width]);
}

/// `y += factor x`.
#[inline(always)]
fn add<T: Number, S: Simd>(simd: S, factor: T, x: &Wide<T>, y: &mut Wide<T>) {
    let factor = factor.all(simd);
    for (y, &x) in T::parts_mut::<S>(y).iter_mut().zip(T::parts::<S>(x)) {
        *y = T::add_product(simd, factor, x, *y);
    }
}
