//! Numeric factors of own subdomains: each its own, or one for several that are alike.
//!
//! Subdomains that are congruent and alike have equal factors. One copy is kept, and they are worked on together, up to
//! [`WIDTH`] at a time, so that the copy is read once for all of them.

use std::cell::OnceCell;
use std::collections::HashMap;
use std::rc::Rc;

use crate::sparse::cholesky::WIDTH;

/// One item for each own subdomain.
pub struct Stock<T> {
    items: Vec<Rc<T>>,
    common: Vec<bool>,
    /// Made when they are asked for.
    batches: OnceCell<Vec<Batch>>,
}

/// Own subdomains that are worked on together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Batch {
    /// One subdomain with an item of its own.
    Alone(usize),
    /// Up to [`WIDTH`] subdomains with one item. A single one, too, if its twins are on other ranks: results must not depend on
    /// which rank has which subdomain.
    Twins(Vec<usize>),
}

impl<T> Stock<T> {
    /// One item for each own subdomain.
    pub fn new(items: impl IntoIterator<Item = T>) -> Self {
        let items: Vec<Rc<T>> = items.into_iter().map(Rc::new).collect();
        let common = vec![false; items.len()];
        Self { items, common, batches: OnceCell::new() }
    }

    /// The item of an own subdomain.
    pub fn of(&self, own: usize) -> &T {
        &self.items[own]
    }

    /// The item of an own subdomain, to be overwritten. `common` says that it has twins, here or on other ranks: it
    /// is worked on in a batch of twins.
    pub fn renew(&mut self, own: usize, common: bool, fresh: impl FnOnce() -> T) -> &mut T {
        if Rc::get_mut(&mut self.items[own]).is_none() {
            self.items[own] = Rc::new(fresh());
        }
        self.common[own] = common;
        self.batches.take();
        Rc::get_mut(&mut self.items[own]).expect("nobody else has it")
    }

    /// From now on an own subdomain has the item of its twin; `common` as in [`Stock::renew`].
    pub fn share(&mut self, own: usize, twin: usize, common: bool) {
        self.items[own] = Rc::clone(&self.items[twin]);
        self.common[own] = common;
        self.batches.take();
    }

    /// All own subdomains, batch by batch.
    pub fn batches(&self) -> &[Batch] {
        self.batches.get_or_init(|| self.sort())
    }

    fn sort(&self) -> Vec<Batch> {
        let mut batches = Vec::new();
        let mut open: HashMap<*const T, usize> = HashMap::new();
        for (own, item) in self.items.iter().enumerate() {
            if !self.common[own] {
                batches.push(Batch::Alone(own));
                continue;
            }
            let batch = open.entry(Rc::as_ptr(item)).or_insert(usize::MAX);
            match batches.get_mut(*batch) {
                Some(Batch::Twins(twins)) if twins.len() < WIDTH => twins.push(own),
                _ => {
                    *batch = batches.len();
                    batches.push(Batch::Twins(vec![own]));
                }
            }
        }
        batches
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn twins_are_worked_on_together_and_leave_when_they_change() {
        let mut stock = Stock::new(0..11);
        assert_eq!(stock.batches(), (0..11).map(Batch::Alone).collect::<Vec<_>>());
        *stock.renew(1, true, || unreachable!("nobody shares it")) = 7;
        assert_eq!(stock.batches()[1], Batch::Twins(vec![1]));
        for own in [0, 2, 3, 5, 6, 7, 8, 9, 10] {
            stock.share(own, 1, true);
        }
        let first = Batch::Twins(vec![0, 1, 2, 3, 5, 6, 7, 8]);
        assert_eq!(stock.batches(), [first, Batch::Alone(4), Batch::Twins(vec![9, 10])]);
        *stock.renew(2, false, || 0) = 5;
        let first = Batch::Twins(vec![0, 1, 3, 5, 6, 7, 8, 9]);
        assert_eq!(stock.batches(), [first, Batch::Alone(2), Batch::Alone(4), Batch::Twins(vec![10])]);
        assert_eq!((0..11).map(|own| *stock.of(own)).collect::<Vec<_>>(), [7, 7, 5, 7, 4, 7, 7, 7, 7, 7, 7]);
    }
}
