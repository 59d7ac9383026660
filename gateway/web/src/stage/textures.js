// Images on surfaces. Each is requested once by its hash. Browsers also keep them for later episodes in the same scene.

import { CubeTexture, LinearMipmapLinearFilter, NoColorSpace, RepeatWrapping, SRGBColorSpace, Texture } from "three";

/** Number of samples of an image along a surface that is seen at a slant. */
const ANISOTROPY = 4;

/** Requests an image from the server by its hash. @typedef {(hash: string) => Promise<Response>} TextureSource */

/** The images of one scene. */
export class Textures {
  /**
   * @param {import("../message.js").TextureHead[]} heads
   * @param {TextureSource} source
   * @param {boolean} isLinear True if values of images are used as colours of light directly, false if they are sRGB.
   */
  constructor(heads, source, isLinear) {
    this.heads = heads;
    this.source = source;
    this.colours = isLinear ? NoColorSpace : SRGBColorSpace;
    /** @type {Map<string, Promise<Blob>>} */
    this.files = new Map();
    /** @type {Map<string, Promise<Texture>>} */
    this.made = new Map();
  }

  /** Returns the mean colour of an image, in the values of its file. @param {number} number */
  mean(number) { return this.heads[number].mean_rgb; }

  /** Returns an image of colours. @param {number} number */
  colour(number) { return this.flat(number, this.colours); }

  /** Returns an image of numbers other than colours. @param {number} number */
  numbers(number) { return this.flat(number, NoColorSpace); }

  /** Returns the image of a cube, on six sides. @param {number} number */
  cube(number) {
    return this.once(`${number} cube`, async () => {
      const file = await this.file(number);
      const { width, height } = await bitmap(file).then(closed);
      const { images } = this.heads[number];
      const rows = height / images;
      const side = Math.max(width, rows);
      const faces = Array.from({ length: 6 }, (_, face) =>
        bitmap(file, [0, (face % images) * rows, width, rows], { resizeWidth: side, resizeHeight: side }));
      const texture = new CubeTexture(await Promise.all(faces));
      texture.colorSpace = this.colours;
      return texture;
    });
  }

  /** @param {number} number @param {string} colorSpace */
  flat(number, colorSpace) {
    return this.once(`${number} ${colorSpace}`, async () => {
      const texture = new Texture(await bitmap(await this.file(number)));
      // Coordinates go to the right and down from the top left corner.
      texture.flipY = false;
      texture.wrapS = texture.wrapT = RepeatWrapping;
      texture.colorSpace = colorSpace;
      return texture;
    });
  }

  /** @param {string} key @param {() => Promise<Texture>} make @returns {Promise<Texture>} */
  once(key, make) {
    const known = this.made.get(key);
    if (known) return known;
    const made = make().then((texture) => {
      texture.minFilter = LinearMipmapLinearFilter;
      texture.anisotropy = ANISOTROPY;
      texture.needsUpdate = true;
      return texture;
    });
    this.made.set(key, made);
    return made;
  }

  /** @param {number} number @returns {Promise<Blob>} */
  file(number) {
    const { hash } = this.heads[number];
    const known = this.files.get(hash);
    if (known) return known;
    const file = this.source(hash).then((answer) => {
      if (!answer.ok) throw new Error(`the server answers ${answer.status} for an image on a surface`);
      return answer.blob();
    });
    this.files.set(hash, file);
    return file;
  }
}

/**
 * Decodes an image, or a part of an image, without a change of its values.
 * @param {Blob} file
 * @param {[number, number, number, number]} [part]
 * @param {ImageBitmapOptions} [size]
 */
function bitmap(file, part, size) {
  /** @type {ImageBitmapOptions} */
  const options = { colorSpaceConversion: "none", premultiplyAlpha: "none", ...size };
  return part ? createImageBitmap(file, ...part, options) : createImageBitmap(file, options);
}

/** Returns the size of an image that is not needed any more. @param {ImageBitmap} image */
function closed(image) {
  const { width, height } = image;
  image.close();
  return { width, height };
}
