//! How the kernel reads and writes memory: without bounds checks where the plan guarantees validity, or, with the
//! feature `checked`, with checks that panic. The two variants differ only in this file.
//!
//! The tests run with both variants, the fuzz targets with checks.

#[cfg(feature = "checked")]
pub(crate) use checked::*;
#[cfg(not(feature = "checked"))]
pub(crate) use trusted::*;

#[cfg(not(feature = "checked"))]
mod trusted {
    use core::marker::PhantomData;

    /// # Safety
    /// `k < values.len()`
    #[inline(always)]
    pub(crate) unsafe fn at<T>(values: &[T], k: usize) -> &T {
        // SAFETY: upheld by the caller.
        unsafe { values.get_unchecked(k) }
    }

    /// # Safety
    /// `k < values.len()`
    #[inline(always)]
    pub(crate) unsafe fn at_mut<T>(values: &mut [T], k: usize) -> &mut T {
        // SAFETY: upheld by the caller.
        unsafe { values.get_unchecked_mut(k) }
    }

    /// `count` values starting at `start`.
    ///
    /// # Safety
    /// `start + count <= values.len()`
    #[inline(always)]
    pub(crate) unsafe fn part<T>(values: &[T], start: usize, count: usize) -> &[T] {
        // SAFETY: upheld by the caller.
        unsafe { values.get_unchecked(start..start + count) }
    }

    /// # Safety
    /// `count <= values.len()`
    #[inline(always)]
    pub(crate) unsafe fn split<T>(values: &[T], count: usize) -> (&[T], &[T]) {
        // SAFETY: upheld by the caller.
        unsafe { values.split_at_unchecked(count) }
    }

    /// Rounds towards zero.
    ///
    /// # Safety
    /// The result fits an i32.
    #[inline(always)]
    pub(crate) unsafe fn whole(x: f32) -> i32 {
        // SAFETY: upheld by the caller.
        unsafe { x.to_int_unchecked() }
    }

    /// A read position in a row of values.
    pub(crate) struct Cursor<'s, T>(*const T, PhantomData<&'s T>);

    impl<T> Clone for Cursor<'_, T> {
        fn clone(&self) -> Self {
            *self
        }
    }

    impl<T> Copy for Cursor<'_, T> {}

    impl<'s, T: Copy> Cursor<'s, T> {
        #[inline(always)]
        pub(crate) fn start(values: &'s [T]) -> Self {
            Self(values.as_ptr(), PhantomData)
        }

        /// Over an empty range: nothing may be read.
        #[inline(always)]
        pub(crate) fn start_of(values: Option<&'s [T]>) -> Self {
            Self(values.map_or(core::ptr::null(), <[T]>::as_ptr), PhantomData)
        }

        /// # Safety
        /// `count` values exist here, and those that are read have been initialised.
        #[inline(always)]
        pub(crate) unsafe fn raw(first: *const T, _count: usize) -> Self {
            Self(first, PhantomData)
        }

        /// # Safety
        /// There is a value `k` places from here.
        #[inline(always)]
        pub(crate) unsafe fn at(self, k: usize) -> T {
            // SAFETY: upheld by the caller.
            unsafe { *self.0.add(k) }
        }

        /// The value `offset` bytes from here.
        ///
        /// # Safety
        /// There is one.
        #[inline(always)]
        pub(crate) unsafe fn at_byte(self, offset: usize) -> T {
            // SAFETY: upheld by the caller.
            unsafe { *self.0.byte_add(offset) }
        }

        /// # Safety
        /// There are `count` values from here.
        #[inline(always)]
        pub(crate) unsafe fn skip(self, count: usize) -> Self {
            // SAFETY: upheld by the caller.
            Self(unsafe { self.0.add(count) }, PhantomData)
        }
    }

    /// A write position in a row of values.
    pub(crate) struct CursorMut<'s>(*mut f32, PhantomData<&'s mut f32>);

    impl<'s> CursorMut<'s> {
        #[inline(always)]
        pub(crate) fn start(values: &'s mut [f32]) -> Self {
            Self(values.as_mut_ptr(), PhantomData)
        }

        /// Writes values that may be uninitialised.
        ///
        /// # Safety
        /// There is room for `count` values.
        #[inline(always)]
        pub(crate) unsafe fn raw(first: *mut f32, _count: usize) -> Self {
            Self(first, PhantomData)
        }

        #[inline(always)]
        pub(crate) fn reborrow(&mut self) -> CursorMut<'_> {
            CursorMut(self.0, PhantomData)
        }

        /// # Safety
        /// There is room for a value `k` places from here.
        #[inline(always)]
        pub(crate) unsafe fn set(&mut self, k: usize, value: f32) {
            // SAFETY: upheld by the caller.
            unsafe { *self.0.add(k) = value }
        }

        /// # Safety
        /// There is room for `count` values from here.
        #[inline(always)]
        pub(crate) unsafe fn skip(self, count: usize) -> Self {
            // SAFETY: upheld by the caller.
            Self(unsafe { self.0.add(count) }, PhantomData)
        }
    }
}

#[cfg(feature = "checked")]
mod checked {
    // Marked unsafe to match the unchecked variants.

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
        assert!(
            x > -2_147_483_904.0 && x < 2_147_483_648.0,
            "{x} does not fit an i32"
        );
        x as i32
    }

    #[derive(Clone, Copy)]
    pub(crate) struct Cursor<'s, T>(&'s [T]);

    impl<'s, T: Copy> Cursor<'s, T> {
        pub(crate) fn start(values: &'s [T]) -> Self {
            Self(values)
        }

        pub(crate) fn start_of(values: Option<&'s [T]>) -> Self {
            Self(values.unwrap_or_default())
        }

        pub(crate) unsafe fn raw(first: *const T, count: usize) -> Self {
            // SAFETY: upheld by the caller; all values are written, see `CursorMut::raw`.
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
    }

    pub(crate) struct CursorMut<'s>(&'s mut [f32]);

    impl<'s> CursorMut<'s> {
        pub(crate) fn start(values: &'s mut [f32]) -> Self {
            Self(values)
        }

        pub(crate) unsafe fn raw(first: *mut f32, count: usize) -> Self {
            for k in 0..count {
                // SAFETY: upheld by the caller. A value read before it is written is NaN.
                unsafe { *first.add(k) = f32::NAN };
            }
            // SAFETY: upheld by the caller, and all values are initialised now.
            Self(unsafe { core::slice::from_raw_parts_mut(first, count) })
        }

        pub(crate) fn reborrow(&mut self) -> CursorMut<'_> {
            CursorMut(self.0)
        }

        pub(crate) unsafe fn set(&mut self, k: usize, value: f32) {
            self.0[k] = value;
        }

        pub(crate) unsafe fn skip(self, count: usize) -> Self {
            Self(&mut self.0[count..])
        }
    }
}
