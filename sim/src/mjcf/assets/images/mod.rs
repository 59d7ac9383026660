//! Images of textures: from a file, from a file or a part of one for each face of a cube, or MuJoCo's builtin
//! ones.

mod builtin;
mod ktx;

use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use image::{DynamicImage, ImageReader, Rgb, RgbImage};
use roxmltree::Node;
use xxhash_rust::xxh3::xxh3_64;

use super::files::read_mesh_bytes;
use super::texture::Texture;
use crate::SimError;
use crate::mjcf::Document;
use crate::srgb::linear_light;
use crate::user_file::with_own_separators;
use ktx::KtxImages;

/// Attributes with the files of a cube's faces, +x, -x, +y, -y, +z and -z, and their letters in `gridlayout`.
const FACES: [(&str, char); 6] = [
    ("fileright", 'R'),
    ("fileleft", 'L'),
    ("fileup", 'U'),
    ("filedown", 'D'),
    ("filefront", 'F'),
    ("fileback", 'B'),
];

/// Files that were read, each with a hash of its bytes.
type Read = Vec<(PathBuf, u64)>;

impl Document {
    /// Reads the images of textures that name files, and draws those that MuJoCo draws itself.
    pub(in crate::mjcf) fn read_textures(&mut self) -> Result<(), SimError> {
        let (mut textures, mut builtins, mut read, mut sky) = (Vec::new(), Vec::new(), Vec::new(), None);
        let xml = self.source.xml()?;
        for node in xml.descendants().filter(|node| node.has_tag_name("texture")) {
            let name = name(&node);
            let of_files = self.images_of_files(&node, &mut read)?;
            let drawn = if of_files.is_empty() { builtin::images(&node) } else { Vec::new() };
            let found = match (of_files.is_empty(), drawn.is_empty()) {
                (false, _) => Arc::new(of_files_texture(&node, of_files)),
                (true, false) => Arc::new(Texture::of(&drawn)),
                (true, true) => continue,
            };
            if node.attribute("type") == Some("skybox") {
                sky.get_or_insert(found.clone());
            }
            // A builtin sky is not the texture of a material.
            match (drawn.is_empty(), node.attribute("type")) {
                (true, _) => textures.push((name, found)),
                (false, Some("skybox")) => {}
                (false, _) => builtins.push((name, found)),
            }
        }
        drop(xml);
        self.sky = sky;
        self.textures.extend(textures);
        self.builtins.extend(builtins);
        self.files.append(&mut read);
        Ok(())
    }

    /// Returns the image of a texture's file, or six images for the faces of a cube. Returns none if the
    /// texture names no file.
    fn images_of_files(&self, node: &Node, read: &mut Read) -> Result<Vec<DynamicImage>, SimError> {
        let mut images = |file: &str| self.images_of_file(node, file, read);
        if let Some(file) = node.attribute("file") {
            let images = images(file)?;
            return Ok(faces_of_grid(node, &images[0]).unwrap_or(images));
        }
        if FACES.iter().all(|(attribute, _)| node.attribute(*attribute).is_none()) {
            return Ok(Vec::new());
        }
        let blank = DynamicImage::from(blank(node));
        let face = |(attribute, _): &(&str, char)| match node.attribute(*attribute) {
            Some(file) => Ok(images(file)?.swap_remove(0)),
            None => Ok(blank.clone()),
        };
        FACES.iter().map(face).collect()
    }

    /// Returns the images in a file, at least one.
    fn images_of_file(
        &self,
        node: &Node,
        file: &str,
        read: &mut Read,
    ) -> Result<Vec<DynamicImage>, SimError> {
        let asset = mjcf_rs::assets::Texture { file: Some(file.into()), ..Default::default() };
        let path = self.model.resolve_texture_file(&asset, &self.folder).unwrap_or_else(|| file.into());
        let path = self.source.beside_including(with_own_separators(path));
        let bytes = read_mesh_bytes(&path).map_err(|source| SimError::unreadable(&path, source))?;
        let (images, says_srgb) = decode(&path, &bytes)?;
        let is_srgb = match node.attribute("colorspace") {
            Some("sRGB") => true,
            Some("linear") => false,
            _ => says_srgb,
        };
        read.push((path, xxh3_64(&bytes)));
        // MuJoCo converts such an image to linear light, and then draws the result as if it were the file's
        // values.
        Ok(match is_srgb && self.lights.is_some() {
            true => images.into_iter().map(decoded).collect(),
            false => images,
        })
    }
}

/// Decodes an image file: one image, or six for a cube in a KTX2 file. Also returns true if the file declares
/// its values to be sRGB.
/// values are sRGB.
///
/// # Errors
///
/// Returns an error that names the file if the bytes are no image of a supported format.
fn decode(path: &Path, bytes: &[u8]) -> Result<(Vec<DynamicImage>, bool), SimError> {
    let refuse = |source| SimError::Texture { path: path.display().to_string(), source };
    if let Some(KtxImages { faces, is_srgb }) = KtxImages::decode(bytes).map_err(refuse)? {
        return Ok((faces, is_srgb));
    }
    let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format();
    let decoded = reader.map_err(|source| SimError::unreadable(path, source))?.decode();
    Ok((vec![decoded.map_err(|source| refuse(source.into()))?], states_srgb(bytes)))
}

/// Returns true if a PNG file declares its values to be sRGB.
fn states_srgb(bytes: &[u8]) -> bool {
    const SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";
    /// Bytes of a chunk besides its content: length, name and checksum.
    const AROUND_BYTES: usize = 12;
    let Some(mut rest) = bytes.strip_prefix(SIGNATURE) else { return false };
    while let Some((length, after)) = rest.split_first_chunk::<4>() {
        match after.first_chunk::<4>() {
            Some(b"sRGB") => return true,
            Some(b"IDAT") | None => return false,
            Some(_) => {}
        }
        let chunk_bytes = (u32::from_be_bytes(*length) as usize).saturating_add(AROUND_BYTES);
        rest = rest.get(chunk_bytes..).unwrap_or_default();
    }
    false
}

/// Returns an image with the values of another, converted from sRGB to linear light.
fn decoded(image: DynamicImage) -> DynamicImage {
    let light: [u8; 256] = std::array::from_fn(|byte| {
        let linear_value = linear_light(byte as f32 / 255.0);
        (255.0 * linear_value).round() as u8
    });
    let mut image = image.into_rgba8();
    for pixel in image.pixels_mut() {
        for value in &mut pixel.0[..3] {
            *value = light[usize::from(*value)];
        }
    }
    image.into()
}

/// Reduces the images of files. Their alpha counts if the texture states `nchannel="4"`, as in MuJoCo.
fn of_files_texture(node: &Node, images: Vec<DynamicImage>) -> Texture {
    let is_clear = |image: &DynamicImage| image.to_rgba8().pixels().any(|pixel| pixel.0[3] < u8::MAX);
    if node.attribute("nchannel") == Some("4") && images.iter().any(is_clear) {
        let images: Vec<_> = images.into_iter().map(DynamicImage::into_rgba8).collect();
        return Texture::with_alpha(&images);
    }
    let images: Vec<_> = images.into_iter().map(DynamicImage::into_rgb8).collect();
    Texture::of(&images)
}

/// Cuts the faces of a cube out of an image by `gridsize` and `gridlayout`. Returns `None` without these. A
/// face that the layout lacks has the colour `rgb1`.
fn faces_of_grid(node: &Node, whole: &DynamicImage) -> Option<Vec<DynamicImage>> {
    let mut sizes =
        node.attribute("gridsize")?.split_ascii_whitespace().map_while(|word| word.parse::<u32>().ok());
    let (rows, columns) =
        (sizes.next().filter(|rows| *rows > 0)?, sizes.next().filter(|columns| *columns > 0)?);
    let letters: Vec<char> = node.attribute("gridlayout")?.chars().collect();
    let (width, height) = (whole.width() / columns, whole.height() / rows);
    if rows * columns == 1 || width == 0 || height == 0 {
        return None;
    }
    let face = |(_, letter): &(&str, char)| match letters.iter().position(|found| found == letter) {
        Some(cell) if (cell as u32) < rows * columns => {
            let (row, column) = (cell as u32 / columns, cell as u32 % columns);
            whole.crop_imm(column * width, row * height, width, height)
        }
        _ => blank(node).into(),
    };
    Some(FACES.iter().map(face).collect())
}

/// Returns an image of the colour `rgb1`.
fn blank(node: &Node) -> RgbImage {
    RgbImage::from_pixel(1, 1, Rgb(builtin::first_colour(node)))
}

/// Returns the name of a texture, or that of its file if it has none.
fn name(node: &Node) -> String {
    let file = || Path::new(node.attribute("file")?).file_stem()?.to_str();
    node.attribute("name").or_else(file).unwrap_or_default().to_owned()
}
