//! Attributes: short arrays of numbers and texts attached to groups.
use std::path::Path;

use hdf5::Attribute;
use hdf5::plist::attribute_create::CharEncoding;
use hdf5::types::TypeDescriptor;
use hdf5_sys::h5a::{H5Aread, H5Awrite};
use hdf5_sys::h5t::{H5T_STRING, H5Tget_class, H5Tis_variable_str};

use super::{Element, FileError, Kind, OfFile as _, Reader, Writer, library, open_object};

impl Writer {
    /// Collective. Attaches an array to an object; one value makes an array of length one.
    pub fn set_attribute<T: Element>(&self, object: &str, name: &str, values: &[T]) -> Result<(), FileError> {
        let set = self.on_rank_0(|file, path| {
            let attach = || {
                let object = open_object(file, object)?.new_attr_builder();
                object.char_encoding(CharEncoding::Ascii).with_data(values).create(name)
            };
            attach().of_file(path, "set", name)
        });
        set.map(drop)
    }

    /// Collective. Attaches a text to an object as a scalar of fixed length, in ASCII where that is enough:
    /// VTK expects it.
    pub fn set_text(&self, object: &str, name: &str, text: &str) -> Result<(), FileError> {
        self.set_texts(object, &[(name, text)])
    }

    /// Collective. Attaches texts by name to an object, as [`set_text`](Self::set_text) does.
    pub fn set_texts(&self, object: &str, texts: &[(&str, &str)]) -> Result<(), FileError> {
        let set = self.on_rank_0(|file, path| {
            texts.iter().try_for_each(|(name, text)| attach_text(file, path, object, name, text))
        });
        set.map(drop)
    }
}

fn attach_text(
    file: &hdf5::File,
    path: &Path,
    object: &str,
    name: &str,
    text: &str,
) -> Result<(), FileError> {
    // A string of length 0 is no valid type.
    let bytes = if text.is_empty() { b"\0" } else { text.as_bytes() };
    let kind = match text.is_ascii() {
        true => TypeDescriptor::FixedAscii(bytes.len()),
        false => TypeDescriptor::FixedUnicode(bytes.len()),
    };
    let attach = || {
        let object = open_object(file, object)?.new_attr_builder();
        let attribute = object.char_encoding(CharEncoding::Ascii).empty_as(&kind).create(name)?;
        let kind = attribute.dtype()?;
        // SAFETY: an open attribute with one element of that type, which has as many bytes.
        hdf5::h5check(unsafe { H5Awrite(attribute.id(), kind.id(), bytes.as_ptr().cast()) })
    };
    attach().map(drop).of_file(path, "set", name)
}

impl Reader {
    /// Not collective. True when the object has that attribute.
    pub fn has_attribute(&self, object: &str, name: &str) -> bool {
        let _turn = library();
        self.exists(object) && open_object(self.file(), object).and_then(|found| found.attr(name)).is_ok()
    }

    /// Not collective. The values of a numeric attribute, whose numbers must be of type `T`.
    pub fn attribute<T: Element>(&self, object: &str, name: &str) -> Result<Vec<T>, FileError> {
        let _turn = library();
        let (attribute, full) = (self.open_attribute(object, name)?, format!("attribute {object}/{name}"));
        let kind = attribute.dtype().of_file(self.path(), "read", &full)?;
        if Kind::of_type(&kind) != Some(T::KIND) {
            return Err(self.refuse(format!("{full} does not hold {}", T::KIND)));
        }
        self.held_bytes(&full, self.elements(&attribute, &full)?, size_of::<T>())?;
        attribute.read_raw().of_file(self.path(), "read", &full)
    }

    /// Not collective. A text attribute.
    pub fn text(&self, object: &str, name: &str) -> Result<String, FileError> {
        let _turn = library();
        let (attribute, full) = (self.open_attribute(object, name)?, format!("attribute {object}/{name}"));
        let kind = attribute.dtype().of_file(self.path(), "read", &full)?;
        // SAFETY: an open type. An element of variable length would be read as the address of its letters.
        let fixed = unsafe { H5Tget_class(kind.id()) == H5T_STRING && H5Tis_variable_str(kind.id()) == 0 };
        if !fixed || self.elements(&attribute, &full)? != 1 {
            return Err(self.refuse(format!("{full} is not one text of fixed length")));
        }
        let length = self.held_bytes(&full, 1, kind.size())?;
        let mut bytes = vec![0_u8; length as usize];
        // SAFETY: an open attribute with one element of that type; the buffer is as long as that.
        let code = unsafe { H5Aread(attribute.id(), kind.id(), bytes.as_mut_ptr().cast()) };
        hdf5::h5check(code).of_file(self.path(), "read", &full)?;
        let end = bytes.iter().position(|&b| b == 0).unwrap_or(bytes.len());
        bytes.truncate(end);
        String::from_utf8(bytes).map_err(|_| self.refuse(format!("{full} is not UTF-8")))
    }

    /// Not collective. Elements of an attribute.
    fn elements(&self, attribute: &Attribute, name: &str) -> Result<u64, FileError> {
        Ok(attribute.space().of_file(self.path(), "read", name)?.size() as u64)
    }

    fn open_attribute(&self, object: &str, name: &str) -> Result<Attribute, FileError> {
        self.leads_to(object)?;
        if !self.has_attribute(object, name) {
            return Err(self.refuse(format!("attribute {name} of {object} is missing")));
        }
        open_object(self.file(), object).and_then(|found| found.attr(name)).of_file(self.path(), "read", name)
    }
}
