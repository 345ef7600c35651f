//! How the kernel gets at memory: without a check of what it has proved, or with the feature `checked`
//! with one, which panics. Everything else is the same code.
//!
//! Here stands all of what differs. The tests run with both, the fuzz targets with checks.

#[cfg(feature = "checked")]
pub(crate) use checked::*;
#[cfg(not(feature = "checked"))]
pub(crate) use trusted::*;

/// The pointer itself, but the compiler does not know: it neither unrolls a loop that walks with it
/// nor splits the address. On the Cortex-M both cost more than they save in loops that run a few
/// times.
#[inline(always)]
pub(crate) fn opaque<T>(pointer: *const T) -> *const T {
    #[cfg(target_arch = "arm")]
    // SAFETY: no instruction at all.
    unsafe {
        let same;
        core::arch::asm!("/* {0} */", inlateout(reg) pointer => same, options(pure, nomem, nostack, preserves_flags));
        same
    }
    #[cfg(not(target_arch = "arm"))]
    pointer
}

#[cfg(not(feature = "checked"))]
mod trusted {
    use super::opaque;
    use core::marker::PhantomData;

    /// # Safety
    /// `k < values.len()`
    #[inline(always)]
    pub(crate) unsafe fn at<T>(values: &[T], k: usize) -> &T {
        // SAFETY: the caller's.
        unsafe { values.get_unchecked(k) }
    }

    /// # Safety
    /// `k < values.len()`
    #[inline(always)]
    pub(crate) unsafe fn at_mut<T>(values: &mut [T], k: usize) -> &mut T {
        // SAFETY: the caller's.
        unsafe { values.get_unchecked_mut(k) }
    }

    /// `count` values from `start` on.
    ///
    /// # Safety
    /// They are there.
    #[inline(always)]
    pub(crate) unsafe fn part<T>(values: &[T], start: usize, count: usize) -> &[T] {
        // SAFETY: the caller's.
        unsafe { values.get_unchecked(start..start + count) }
    }

    /// # Safety
    /// `count <= values.len()`
    #[inline(always)]
    pub(crate) unsafe fn split<T>(values: &[T], count: usize) -> (&[T], &[T]) {
        // SAFETY: the caller's.
        unsafe { values.split_at_unchecked(count) }
    }

    /// Towards zero.
    ///
    /// # Safety
    /// The result is an i32.
    #[inline(always)]
    pub(crate) unsafe fn whole(x: f32) -> i32 {
        // SAFETY: the caller's.
        unsafe { x.to_int_unchecked() }
    }

    /// Values from some place on.
    pub(crate) struct From<'s, T>(*const T, PhantomData<&'s T>);

    impl<T> Clone for From<'_, T> {
        fn clone(&self) -> Self {
            *self
        }
    }

    impl<T> Copy for From<'_, T> {}

    impl<'s, T: Copy> From<'s, T> {
        #[inline(always)]
        pub(crate) fn start(values: &'s [T]) -> Self {
            Self(values.as_ptr(), PhantomData)
        }

        /// # Safety
        /// There are `count` values, of which those are written that are read.
        #[inline(always)]
        pub(crate) unsafe fn raw(first: *const T, _count: usize) -> Self {
            Self(first, PhantomData)
        }

        /// # Safety
        /// There is a value number `k` from here.
        #[inline(always)]
        pub(crate) unsafe fn at(self, k: usize) -> T {
            // SAFETY: the caller's.
            unsafe { *self.0.add(k) }
        }

        /// The value so many bytes from here.
        ///
        /// # Safety
        /// There is one.
        #[inline(always)]
        pub(crate) unsafe fn at_byte(self, offset: usize) -> T {
            // SAFETY: the caller's.
            unsafe { *self.0.byte_add(offset) }
        }

        /// # Safety
        /// There are `count` values from here.
        #[inline(always)]
        pub(crate) unsafe fn skip(self, count: usize) -> Self {
            // SAFETY: the caller's.
            Self(unsafe { self.0.add(count) }, PhantomData)
        }

        /// For what has instructions of its own.
        #[cfg(all(target_arch = "arm", target_abi = "eabihf"))]
        #[inline(always)]
        pub(crate) fn pointer(self) -> *const T {
            self.0
        }

        /// See [`opaque`].
        #[inline(always)]
        pub(crate) fn opaque(self) -> Self {
            Self(opaque(self.0), PhantomData)
        }
    }

    /// Where values are written from some place on.
    pub(crate) struct To<'s>(*mut f32, PhantomData<&'s mut f32>);

    impl<'s> To<'s> {
        /// # Safety
        /// There is room for `count` values.
        #[inline(always)]
        pub(crate) unsafe fn start(first: *mut f32, _count: usize) -> Self {
            Self(first, PhantomData)
        }

        #[inline(always)]
        pub(crate) fn again(&mut self) -> To<'_> {
            To(self.0, PhantomData)
        }

        /// # Safety
        /// There is room for a value number `k` from here.
        #[inline(always)]
        pub(crate) unsafe fn set(&mut self, k: usize, value: f32) {
            // SAFETY: the caller's.
            unsafe { *self.0.add(k) = value }
        }

        /// # Safety
        /// There is room for `count` values from here.
        #[inline(always)]
        pub(crate) unsafe fn skip(self, count: usize) -> Self {
            // SAFETY: the caller's.
            Self(unsafe { self.0.add(count) }, PhantomData)
        }

        /// # Safety
        /// There is room for `count` values from here.
        #[inline(always)]
        pub(crate) unsafe fn pointer(self, _count: usize) -> *mut f32 {
            self.0
        }
    }
}

#[cfg(feature = "checked")]
mod checked {
    // As unsafe to call as their twins.

    pub(crate) unsafe fn at<T>(values: &[T], k: usize) -> &T {
        &values[k]
    }

    pub(crate) unsafe fn at_mut<T>(values: &mut [T], k: usize) -> &mut T {
        &mut values[k]
    }

    pub(crate) unsafe fn part<T>(values: &[T], start: usize, count: usize) -> &[T] {
        &values[start..start + count]
    }

    pub(crate) unsafe fn split<T>(values: &[T], count: usize) -> (&[T], &[T]) {
        values.split_at(count)
    }

    pub(crate) unsafe fn whole(x: f32) -> i32 {
        assert!(x > -2_147_483_904.0 && x < 2_147_483_648.0, "{x} is no i32");
        x as i32
    }

    #[derive(Clone, Copy)]
    pub(crate) struct From<'s, T>(&'s [T]);

    impl<'s, T: Copy> From<'s, T> {
        pub(crate) fn start(values: &'s [T]) -> Self {
            Self(values)
        }

        pub(crate) unsafe fn raw(first: *const T, count: usize) -> Self {
            // SAFETY: the caller's; all are written, see `To::start`.
            Self(unsafe { core::slice::from_raw_parts(first, count) })
        }

        pub(crate) unsafe fn at(self, k: usize) -> T {
            self.0[k]
        }

        pub(crate) unsafe fn at_byte(self, offset: usize) -> T {
            assert!(offset.is_multiple_of(size_of::<T>()), "between two values");
            self.0[offset / size_of::<T>()]
        }

        pub(crate) unsafe fn skip(self, count: usize) -> Self {
            Self(&self.0[count..])
        }

        pub(crate) fn opaque(self) -> Self {
            self
        }
    }

    pub(crate) struct To<'s>(&'s mut [f32]);

    impl<'s> To<'s> {
        pub(crate) unsafe fn start(first: *mut f32, count: usize) -> Self {
            for k in 0..count {
                // SAFETY: the caller's. Not a number: what is read without having been written shows.
                unsafe { *first.add(k) = f32::NAN };
            }
            // SAFETY: the caller's, and all are written now.
            Self(unsafe { core::slice::from_raw_parts_mut(first, count) })
        }

        pub(crate) fn again(&mut self) -> To<'_> {
            To(self.0)
        }

        pub(crate) unsafe fn set(&mut self, k: usize, value: f32) {
            self.0[k] = value;
        }

        pub(crate) unsafe fn skip(self, count: usize) -> Self {
            Self(&mut self.0[count..])
        }

        pub(crate) unsafe fn pointer(self, count: usize) -> *mut f32 {
            self.0[..count].as_mut_ptr()
        }
    }
}
