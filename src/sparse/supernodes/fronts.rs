//! Parts of a solve, supernode by supernode up and down the elimination tree.

use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;
use pulp::{Arch, Simd, WithSimd};

use super::{Supernode, backward, eliminate};
use crate::sparse::number::Number;

/// `x = L^-1 x` for the unknowns of some supernodes, ascending; what is to be added to the rows below each comes from its
/// children in `updates`, and is left there for its parent.
pub(in crate::sparse) fn eliminate_all<T: Number>(
    symbolic: &SymbolicSupernodalCholesky<u32>,
    values: &[T],
    (nodes, children): (&[u32], &[Vec<u32>]),
    x: &mut [T],
    updates: &mut [Vec<T>],
) {
    Arch::new().dispatch(EliminateFronts { symbolic, values, nodes, children, x, updates });
}

struct EliminateFronts<'a, T> {
    symbolic: &'a SymbolicSupernodalCholesky<u32>,
    values: &'a [T],
    nodes: &'a [u32],
    children: &'a [Vec<u32>],
    x: &'a mut [T],
    updates: &'a mut [Vec<T>],
}

impl<T: Number> WithSimd for EliminateFronts<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { symbolic, values, nodes, children, x, updates } = self;
        for &s in nodes {
            let node = Supernode::of(symbolic, values, s as usize);
            let end = node.begin + node.width;
            let mut panel = std::mem::take(&mut updates[s as usize]);
            panel.clear();
            panel.extend_from_slice(&x[node.begin..end]);
            panel.resize(node.width + node.below.len(), T::default());
            for &child in &children[s as usize] {
                let mut at = 0;
                for (&row, &update) in symbolic.supernode(child as usize).pattern().iter().zip(&updates[child as usize])
                {
                    let row = row as usize;
                    let place = if row < end {
                        row - node.begin
                    } else {
                        at += node.below[at..]
                            .iter()
                            .position(|&below| below as usize == row)
                            .expect("rows go up the tree");
                        node.width + at
                    };
                    panel[place] = panel[place] + update;
                }
            }
            eliminate(simd, &node, &mut panel);
            x[node.begin..end].copy_from_slice(&panel[..node.width]);
            panel.drain(..node.width);
            updates[s as usize] = panel;
        }
    }
}

/// `x = L^-T x` for the unknowns of some supernodes, ascending, those above them being solved; `panel` is scratch.
pub(in crate::sparse) fn substitute_all<T: Number>(
    symbolic: &SymbolicSupernodalCholesky<u32>,
    values: &[T],
    nodes: &[u32],
    x: &mut [T],
    panel: &mut Vec<T>,
) {
    Arch::new().dispatch(SubstituteFronts { symbolic, values, nodes, x, panel });
}

struct SubstituteFronts<'a, T> {
    symbolic: &'a SymbolicSupernodalCholesky<u32>,
    values: &'a [T],
    nodes: &'a [u32],
    x: &'a mut [T],
    panel: &'a mut Vec<T>,
}

impl<T: Number> WithSimd for SubstituteFronts<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { symbolic, values, nodes, x, panel } = self;
        for &s in nodes.iter().rev() {
            backward(simd, &Supernode::of(symbolic, values, s as usize), x, panel);
        }
    }
}
