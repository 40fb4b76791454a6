//! Eight floats at a time: the arithmetic of the hierarchy's boxes and triangles, by AVX where the machine has it.
//!
//! Every operation is one IEEE operation per lane, nothing is fused or reordered, and `min` and `max` treat NaN
//! alike in both implementations: a ray hits the same to the last bit on every machine. This is the one file
//! with unsafe code.
#![expect(unsafe_code, reason = "AVX must be chosen at run time, as the binary is for every machine")]

/// Eight floats in memory.
pub(super) type Column = [f32; 8];

/// Arithmetic on eight floats. Masks have bit `i` set where lane `i` holds.
pub(super) trait Lanes: Copy {
    /// Eight floats in a register.
    type F: Copy;

    fn splat(self, x: f32) -> Self::F;
    fn load(self, x: &Column) -> Self::F;
    fn store(self, x: Self::F) -> Column;
    fn add(self, a: Self::F, b: Self::F) -> Self::F;
    fn sub(self, a: Self::F, b: Self::F) -> Self::F;
    fn mul(self, a: Self::F, b: Self::F) -> Self::F;
    fn div(self, a: Self::F, b: Self::F) -> Self::F;
    /// The smaller; `b` if either is NaN.
    fn min(self, a: Self::F, b: Self::F) -> Self::F;
    /// The larger; `b` if either is NaN.
    fn max(self, a: Self::F, b: Self::F) -> Self::F;
    fn less(self, a: Self::F, b: Self::F) -> u32;
    fn at_most(self, a: Self::F, b: Self::F) -> u32;
    fn equal(self, a: Self::F, b: Self::F) -> u32;
}

/// A computation that can run on either kind of lanes.
pub(super) trait Kernel {
    type Output;

    /// Implementations are `#[inline(always)]`, so that they are compiled for the instructions of their lanes.
    fn run<L: Lanes>(self, lanes: L) -> Self::Output;
}

/// Runs a kernel on the fastest lanes of this machine.
#[inline(always)]
pub(super) fn dispatch<K: Kernel>(kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    if let Some(avx) = avx::Avx::detect() {
        return avx.run(kernel);
    }
    plainly(kernel)
}

/// Runs a kernel on plain arrays, apart from [`dispatch`], whose callers need not make room for it.
#[inline(never)]
fn plainly<K: Kernel>(kernel: K) -> K::Output {
    kernel.run(Portable)
}

/// Plain arrays, for any machine.
#[derive(Clone, Copy)]
pub(super) struct Portable;

#[inline(always)]
fn each(a: Column, b: Column, f: impl Fn(f32, f32) -> f32) -> Column {
    std::array::from_fn(|i| f(a[i], b[i]))
}

#[inline(always)]
fn mask(a: Column, b: Column, f: impl Fn(&f32, &f32) -> bool) -> u32 {
    (0..8).fold(0, |bits, i| bits | u32::from(f(&a[i], &b[i])) << i)
}

impl Lanes for Portable {
    type F = Column;

    #[inline(always)]
    fn splat(self, x: f32) -> Column {
        [x; 8]
    }
    #[inline(always)]
    fn load(self, x: &Column) -> Column {
        *x
    }
    #[inline(always)]
    fn store(self, x: Column) -> Column {
        x
    }
    #[inline(always)]
    fn add(self, a: Column, b: Column) -> Column {
        each(a, b, |a, b| a + b)
    }
    #[inline(always)]
    fn sub(self, a: Column, b: Column) -> Column {
        each(a, b, |a, b| a - b)
    }
    #[inline(always)]
    fn mul(self, a: Column, b: Column) -> Column {
        each(a, b, |a, b| a * b)
    }
    #[inline(always)]
    fn div(self, a: Column, b: Column) -> Column {
        each(a, b, |a, b| a / b)
    }
    #[inline(always)]
    fn min(self, a: Column, b: Column) -> Column {
        each(a, b, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn max(self, a: Column, b: Column) -> Column {
        each(a, b, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn less(self, a: Column, b: Column) -> u32 {
        mask(a, b, f32::lt)
    }
    #[inline(always)]
    fn at_most(self, a: Column, b: Column) -> u32 {
        mask(a, b, f32::le)
    }
    #[inline(always)]
    fn equal(self, a: Column, b: Column) -> u32 {
        mask(a, b, f32::eq)
    }
}

#[cfg(target_arch = "x86_64")]
mod avx {
    use super::{Column, Kernel, Lanes};
    use std::arch::x86_64::{
        __m256, _CMP_EQ_OQ, _CMP_LE_OQ, _CMP_LT_OQ, _mm256_add_ps, _mm256_cmp_ps, _mm256_div_ps,
        _mm256_loadu_ps, _mm256_max_ps, _mm256_min_ps, _mm256_movemask_ps, _mm256_mul_ps, _mm256_set1_ps,
        _mm256_storeu_ps, _mm256_sub_ps,
    };

    /// Proof that the machine has AVX2: [`Avx::detect`] is the only way to one.
    #[derive(Clone, Copy)]
    pub(super) struct Avx(());

    impl Avx {
        #[inline]
        pub(super) fn detect() -> Option<Self> {
            std::arch::is_x86_feature_detected!("avx2").then_some(Self(()))
        }

        #[inline]
        pub(super) fn run<K: Kernel>(self, kernel: K) -> K::Output {
            #[target_feature(enable = "avx2,bmi1,lzcnt,popcnt")]
            fn with_avx<K: Kernel>(kernel: K, avx: Avx) -> K::Output {
                kernel.run(avx)
            }
            // SAFETY: an `Avx` exists only where AVX2 was found; every CPU with AVX2 has the other three.
            unsafe { with_avx(kernel, self) }
        }
    }

    /// Methods of one intrinsic each.
    macro_rules! intrinsics {
        ($($name:ident($a:ident, $b:ident) -> $out:ty = $call:expr;)*) => {
            $(#[inline(always)]
            fn $name(self, $a: __m256, $b: __m256) -> $out {
                // SAFETY: an `Avx` exists only where AVX2, and so AVX, was found.
                unsafe { $call }
            })*
        };
    }

    impl Lanes for Avx {
        type F = __m256;

        #[inline(always)]
        fn splat(self, x: f32) -> __m256 {
            // SAFETY: an `Avx` exists only where AVX2, and so AVX, was found.
            unsafe { _mm256_set1_ps(x) }
        }
        #[inline(always)]
        fn load(self, x: &Column) -> __m256 {
            // SAFETY: as above, and the reference is to eight floats.
            unsafe { _mm256_loadu_ps(x.as_ptr()) }
        }
        #[inline(always)]
        fn store(self, x: __m256) -> Column {
            let mut column = [0.0; 8];
            // SAFETY: as above, and the array has room for eight floats.
            unsafe { _mm256_storeu_ps(column.as_mut_ptr(), x) };
            column
        }
        intrinsics! {
            add(a, b) -> __m256 = _mm256_add_ps(a, b);
            sub(a, b) -> __m256 = _mm256_sub_ps(a, b);
            mul(a, b) -> __m256 = _mm256_mul_ps(a, b);
            div(a, b) -> __m256 = _mm256_div_ps(a, b);
            min(a, b) -> __m256 = _mm256_min_ps(a, b);
            max(a, b) -> __m256 = _mm256_max_ps(a, b);
            less(a, b) -> u32 = _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(a, b)) as u32;
            at_most(a, b) -> u32 = _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(a, b)) as u32;
            equal(a, b) -> u32 = _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_EQ_OQ>(a, b)) as u32;
        }
    }
}
