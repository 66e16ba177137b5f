//! The numbers of a factor, in single and double precision, and vectors of them that the machine handles at a time.

use std::ops::{Add, Div, Neg, Sub};

use pulp::Simd;

/// What numbers are stored in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// 32 bits. A factor is right to about the condition number times 1e-7.
    Single,
    /// 64 bits.
    Double,
}

/// Numbers of a matrix or a factor.
pub enum Numbers {
    /// In single precision.
    Single(Vec<f32>),
    /// In double precision.
    Double(Vec<f64>),
}

impl Numbers {
    /// So many zeros.
    pub fn new(count: usize, precision: Precision) -> Self {
        match precision {
            Precision::Single => Self::Single(vec![0.0; count]),
            Precision::Double => Self::Double(vec![0.0; count]),
        }
    }

    /// From now on they are these, in this precision.
    pub fn take(&mut self, numbers: impl Iterator<Item = f64>, precision: Precision) {
        if self.precision() != precision {
            *self = Self::new(0, precision);
        }
        match self {
            Self::Single(all) => {
                all.clear();
                all.extend(numbers.map(|x| x as f32));
            }
            Self::Double(all) => {
                all.clear();
                all.extend(numbers);
            }
        }
    }

    /// What they are stored in.
    pub fn precision(&self) -> Precision {
        match self {
            Self::Single(_) => Precision::Single,
            Self::Double(_) => Precision::Double,
        }
    }

    /// One of them.
    pub fn get(&self, at: usize) -> f64 {
        match self {
            Self::Single(numbers) => f64::from(numbers[at]),
            Self::Double(numbers) => numbers[at],
        }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        match self {
            Self::Single(numbers) => numbers.len(),
            Self::Double(numbers) => numbers.len(),
        }
    }

    /// Their size in bytes.
    pub fn bytes(&self) -> usize {
        match self {
            Self::Single(numbers) => size_of_val(&numbers[..]),
            Self::Double(numbers) => size_of_val(&numbers[..]),
        }
    }
}

/// Right-hand sides that are solved together, and partial sums of an inner product.
pub const WIDTH: usize = 8;

/// One unknown of several right-hand sides, or several unknowns of one.
pub(super) type Wide<T> = [T; WIDTH];

/// What a factor's numbers are.
pub(super) trait Number:
    Copy + Default + Add<Output = Self> + Sub<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// Several numbers that the machine handles at a time: [`WIDTH`], or a part of them.
    type Vector<S: Simd>: Copy;

    /// `self * a + b`, rounded once.
    fn fused(self, a: Self, b: Self) -> Self;

    /// A vector of this number.
    fn all<S: Simd>(self, simd: S) -> Self::Vector<S>;

    /// `x * y + z`, rounded once.
    fn add_product<S: Simd>(simd: S, x: Self::Vector<S>, y: Self::Vector<S>, z: Self::Vector<S>) -> Self::Vector<S>;

    /// The vectors that a machine without a vector of [`WIDTH`] numbers has to take instead.
    fn parts<S: Simd>(x: &Wide<Self>) -> &[Self::Vector<S>];

    /// The same, to be overwritten.
    fn parts_mut<S: Simd>(x: &mut Wide<Self>) -> &mut [Self::Vector<S>];
}

macro_rules! number {
    ($number:ty, $vector:ident, $lanes:ident, $splat:ident, $mul_add:ident, $as_simd:ident, $as_mut_simd:ident) => {
        impl Number for $number {
            type Vector<S: Simd> = S::$vector;

            #[inline(always)]
            fn fused(self, a: Self, b: Self) -> Self {
                self.mul_add(a, b)
            }

            #[inline(always)]
            fn all<S: Simd>(self, simd: S) -> S::$vector {
                simd.$splat(self)
            }

            #[inline(always)]
            fn add_product<S: Simd>(simd: S, x: S::$vector, y: S::$vector, z: S::$vector) -> S::$vector {
                simd.$mul_add(x, y, z)
            }

            #[inline(always)]
            fn parts<S: Simd>(x: &Wide<Self>) -> &[S::$vector] {
                const { assert!(WIDTH.is_multiple_of(S::$lanes)) };
                S::$as_simd(x).0
            }

            #[inline(always)]
            fn parts_mut<S: Simd>(x: &mut Wide<Self>) -> &mut [S::$vector] {
                S::$as_mut_simd(x).0
            }
        }
    };
}

number!(f32, f32s, F32_LANES, splat_f32s, mul_add_f32s, as_simd_f32s, as_mut_simd_f32s);
number!(f64, f64s, F64_LANES, splat_f64s, mul_add_f64s, as_simd_f64s, as_mut_simd_f64s);
