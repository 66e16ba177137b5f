//! Kernels compiled for the widest vectors that the machine has, whatever the program is compiled for.

use pulp::{Arch, Simd, WithSimd};

struct Kernel<T, F> {
    argument: T,
    body: F,
}

impl<T, R, F: Fn(T) -> R> WithSimd for Kernel<T, F> {
    type Output = R;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> R {
        (self.body)(self.argument)
    }
}

/// `body(argument)`. The body, and all that it calls, has to be marked `#[inline(always)]`, and may change only what the
/// argument brings: anything else is compiled for the narrow vectors.
#[inline]
pub fn vectorised<T, R>(argument: T, body: impl Fn(T) -> R) -> R {
    Arch::new().dispatch(Kernel { argument, body })
}
