//! Accessors: numbers in buffers, of any component type, strided, normalised, sparse. Every offset is checked before a byte is read.

use super::Source;
use super::document::{Accessor, Sparse};
use crate::scene::error::{Error, ErrorKind};
use crate::scene::limits;

/// Most elements of an accessor that has no buffer view and is zero but for its sparse part.
const EMPTY_ELEMENTS: usize = 1 << 22;

/// A type of components.
#[derive(Clone, Copy, Debug)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn of(code: u32) -> Option<Component> {
        Some(match code {
            5120 => Component::I8,
            5121 => Component::U8,
            5122 => Component::I16,
            5123 => Component::U16,
            5125 => Component::U32,
            5126 => Component::F32,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Component::I8 | Component::U8 => 1,
            Component::I16 | Component::U16 => 2,
            Component::U32 | Component::F32 => 4,
        }
    }

    /// The component at the start of `bytes`, which hold it.
    fn read(self, bytes: &[u8], normalized: bool) -> f32 {
        let pair = || [bytes[0], bytes[1]];
        let four = || [bytes[0], bytes[1], bytes[2], bytes[3]];
        let (value, greatest) = match self {
            Component::I8 => (f32::from(bytes[0] as i8), 127.0),
            Component::U8 => (f32::from(bytes[0]), 255.0),
            Component::I16 => (f32::from(i16::from_le_bytes(pair())), 32767.0),
            Component::U16 => (f32::from(u16::from_le_bytes(pair())), 65535.0),
            Component::U32 => return u32::from_le_bytes(four()) as f32,
            Component::F32 => return f32::from_le_bytes(four()),
        };
        if normalized { (value / greatest).max(-1.0) } else { value }
    }
}

impl Source<'_> {
    /// The elements of an accessor as vectors of `N` numbers. `path` is the place that asks for it.
    ///
    /// # Errors
    /// No such accessor, another number of components, or bytes that no buffer holds.
    pub(super) fn vectors<const N: usize>(&self, index: usize, path: &str) -> Result<Vec<[f32; N]>, Error> {
        let accessor = self.accessor(index, path)?;
        let path = format!("accessors[{index}]");
        if components(&accessor.kind) != Some(N) {
            let expected = format!("{N} components, asked for by {path}");
            return Err(self.fault(ErrorKind::Malformed, &path, format!("type {:?}", accessor.kind), expected));
        }
        let component = self.component(accessor.component_type, &path)?;
        let element = |bytes: &[u8]| std::array::from_fn(|k| component.read(&bytes[k * component.size()..], accessor.normalized));
        let size = N * component.size();
        let mut values = self.base(accessor, size, &path, [0.0; N], element)?;
        if let Some(sparse) = &accessor.sparse {
            let found = self.view(sparse.values.buffer_view, sparse.values.byte_offset, size, sparse.count, &path)?;
            let replaced: Vec<[f32; N]> = found.chunks_exact(size).take(sparse.count).map(element).collect();
            self.scatter(sparse, &replaced, &mut values, &path)?;
        }
        Ok(values)
    }

    /// The elements of a scalar accessor as whole numbers, such as indices of vertices.
    ///
    /// # Errors
    /// As [`vectors`](Self::vectors), and components that are no unsigned integers.
    pub(super) fn indices(&self, index: usize, path: &str) -> Result<Vec<u32>, Error> {
        let accessor = self.accessor(index, path)?;
        let path = format!("accessors[{index}]");
        let component = self.component(accessor.component_type, &path)?;
        if accessor.kind != "SCALAR" || !matches!(component, Component::U8 | Component::U16 | Component::U32) {
            let found = format!("type {:?} of components {}", accessor.kind, accessor.component_type);
            return Err(self.fault(ErrorKind::Malformed, &path, found, "SCALAR of unsigned integers"));
        }
        let mut values = self.base(accessor, component.size(), &path, 0, whole)?;
        if let Some(sparse) = &accessor.sparse {
            let size = component.size();
            let found = self.view(sparse.values.buffer_view, sparse.values.byte_offset, size, sparse.count, &path)?;
            let replaced: Vec<u32> = found.chunks_exact(size).take(sparse.count).map(whole).collect();
            self.scatter(sparse, &replaced, &mut values, &path)?;
        }
        Ok(values)
    }

    fn accessor(&self, index: usize, path: &str) -> Result<&Accessor, Error> {
        let accessor = self.get(&self.document.accessors, index, path, "accessors")?;
        let path = format!("accessors[{index}]");
        if accessor.count == 0 {
            return Err(self.fault(ErrorKind::Malformed, &path, "count 0", "at least 1"));
        }
        if accessor.count > limits::MESH_ELEMENTS * 3 {
            let expected = format!("at most {}", limits::MESH_ELEMENTS * 3);
            return Err(self.fault(ErrorKind::TooLarge, &path, format!("count {}", accessor.count), expected));
        }
        Ok(accessor)
    }

    fn component(&self, code: u32, path: &str) -> Result<Component, Error> {
        let expected = "5120, 5121, 5122, 5123, 5125 or 5126";
        Component::of(code).ok_or_else(|| self.fault(ErrorKind::Malformed, path, format!("componentType {code}"), expected))
    }

    /// What the buffer view says, or zeros.
    fn base<T: Clone>(&self, accessor: &Accessor, size: usize, path: &str, zero: T, element: impl Fn(&[u8]) -> T) -> Result<Vec<T>, Error> {
        let Some(view) = accessor.buffer_view else {
            if accessor.sparse.is_none() || accessor.count > EMPTY_ELEMENTS {
                let found = format!("{} elements in no bufferView", accessor.count);
                return Err(self.fault(ErrorKind::Malformed, path, found, "a bufferView"));
            }
            return Ok(vec![zero; accessor.count]);
        };
        let stride = self.document.buffer_views.get(view).and_then(|view| view.byte_stride).unwrap_or(size);
        if stride < size || stride > 252.max(size) {
            return Err(self.fault(ErrorKind::Malformed, path, format!("byteStride {stride}"), format!("{size} to 252")));
        }
        let span = (accessor.count - 1).checked_mul(stride).and_then(|before| before.checked_add(size)).unwrap_or(usize::MAX);
        let bytes = self.view(view, accessor.byte_offset, span, 1, path)?;
        Ok((0..accessor.count).map(|k| element(&bytes[k * stride..k * stride + size])).collect())
    }

    /// `count` times `size` bytes of a buffer view from `offset` on.
    pub(super) fn view(&self, index: usize, offset: usize, size: usize, count: usize, path: &str) -> Result<&[u8], Error> {
        let view = self.get(&self.document.buffer_views, index, path, "bufferViews")?;
        let buffer = self.buffers.get(view.buffer);
        let whole = buffer.and_then(|bytes| bytes.get(view.byte_offset..view.byte_offset.checked_add(view.byte_length)?));
        let length = size.checked_mul(count);
        let part = whole.and_then(|bytes| bytes.get(offset..offset.checked_add(length?)?));
        part.ok_or_else(|| {
            let found = format!("{size} bytes {count} times from byte {offset} of bufferViews[{index}]");
            self.fault(ErrorKind::Malformed, path, found, "bytes that the buffer holds")
        })
    }

    /// Puts the elements of a sparse accessor in their places.
    fn scatter<T: Clone>(&self, sparse: &Sparse, values: &[T], into: &mut [T], path: &str) -> Result<(), Error> {
        let component = self.component(sparse.indices.component_type, path)?;
        let size = component.size();
        let bytes = self.view(sparse.indices.buffer_view, sparse.indices.byte_offset, size, sparse.count, path)?;
        for (place, value) in bytes.chunks_exact(size).map(whole).zip(values) {
            let count = into.len();
            let expected = || self.fault(ErrorKind::Malformed, path, format!("the sparse index {place}"), format!("0 to {}", count - 1));
            *into.get_mut(place as usize).ok_or_else(expected)? = value.clone();
        }
        Ok(())
    }
}

/// An unsigned integer of 1, 2 or 4 bytes.
fn whole(bytes: &[u8]) -> u32 {
    bytes.iter().rev().fold(0, |value, byte| value << 8 | u32::from(*byte))
}

fn components(kind: &str) -> Option<usize> {
    Some(match kind {
        "SCALAR" => 1,
        "VEC2" => 2,
        "VEC3" => 3,
        "VEC4" | "MAT2" => 4,
        "MAT3" => 9,
        "MAT4" => 16,
        _ => return None,
    })
}
