// The shapes of a scene with their materials: one mesh for all parts of a carrier that differ only in colour.

import { BufferAttribute, BufferGeometry, Color, Mesh, MeshLambertMaterial, MeshPhongMaterial, MeshPhysicalMaterial, Quaternion, SRGBColorSpace, Vector3 } from "three";
import { PATTERNS, patternGlsl } from "./patterns.js";

/** Minimum alpha of solid surfaces, like in the server's images. */
const SOLID_ALPHA = 0.995;
/** Minimum alpha of texels at which a surface with holes is drawn. */
const LEAST_ALPHA = 0.05;
/** Limits of the factor on an image's colours, like in the server's images. */
const [LEAST_MEAN, MOST_TINT] = [1e-6, 8];
/** Roughness of surfaces without a stated one. */
const USUAL_ROUGHNESS = 0.7;
/** Gloss of surfaces without a stated one. @type {import("../message.js").Gloss} */
const USUAL_GLOSS = { emission: 0, specular: 0.5, shininess: 0.5, roughness: null, metallic: 0 };
/** Factor from shininess to the exponent of highlights. */
const SHININESS = 128;

/** @typedef {import("../message.js").Part} Part */
/** @typedef {import("../message.js").Mesh} MeshNumbers */
/** @typedef {MeshLambertMaterial | MeshPhongMaterial | MeshPhysicalMaterial} SurfaceMaterial */
/** @typedef {Mesh<BufferGeometry, SurfaceMaterial>} Surface */

/**
 * Makes the surfaces of scenes. With a file's lights, colours multiply and add up in the values of the file, like in the server's images.
 * Otherwise they are linear light.
 */
export class Surfaces {
  /**
   * @param {import("./textures.js").Textures} textures
   * @param {number | null} shine Highlights of the file's lights as a share of their light; null without such lights.
   * @param {boolean} reflects False without a graphics processor, because reflections would take too long.
   * @param {() => void} changed called when an image has arrived.
   */
  constructor(textures, shine, reflects, changed) {
    this.textures = textures;
    this.shine = shine;
    this.reflects = reflects;
    this.changed = changed;
  }

  /**
   * Makes the surfaces of `parts`, with their carriers.
   * @param {Part[]} parts
   * @param {MeshNumbers[]} meshes
   * @returns {{ mesh: Surface, carrier: import("../message.js").Carrier }[]}
   */
  make(parts, meshes) {
    /** @type {Map<string, Part[]>} */
    const groups = new Map();
    for (const part of parts) {
      const { carrier, casts_shadow: casts, alpha, pattern, second_rgb: second, image, gloss } = part;
      const glow = gloss?.emission ? part.rgb : null;
      const key = JSON.stringify([carrier, casts, alpha, image ? null : [pattern, second], image && { ...image, mapping: image.mapping.kind }, gloss, glow]);
      groups.set(key, [...(groups.get(key) ?? []), part]);
    }
    return [...groups.values()].map((alike) => {
      const mesh = new Mesh(merged(alike, meshes, (part) => this.paint(part)), this.material(alike[0]));
      mesh.castShadow = alike[0].casts_shadow;
      mesh.receiveShadow = true;
      return { mesh, carrier: alike[0].carrier };
    });
  }

  /** Converts a colour of the file. @param {import("../message.js").Rgb} rgb */
  own(rgb) {
    return this.shine === null ? new Color().setRGB(...rgb, SRGBColorSpace) : new Color(...rgb);
  }

  /** Returns the colour of a part; with an image, the factor of its colours. @param {Part} part */
  paint({ rgb, image }) {
    const colour = this.own(rgb);
    if (!image) return colour;
    const mean = this.own(this.textures.mean(image.texture)).toArray();
    const tint = colour.toArray().map((value, axis) => Math.min(value / Math.max(mean[axis], LEAST_MEAN), MOST_TINT));
    return new Color(tint[0], tint[1], tint[2]);
  }

  /**
   * Makes the material of a part. Blended parts block as much light as in the server's images.
   * @param {Part} part
   */
  material(part) {
    const { alpha, image, pattern } = part;
    const gloss = part.gloss ?? USUAL_GLOSS;
    const isBlended = alpha < SOLID_ALPHA;
    const hasHoles = Boolean(image && this.textures.heads[image.texture].has_alpha);
    const blending = isBlended || hasHoles ? { transparent: true, depthWrite: !isBlended, opacity: alpha } : {};
    const material = this.plain(part, gloss, { vertexColors: true, alphaTest: hasHoles ? LEAST_ALPHA : 0, ...blending });
    /** @type {string[]} */
    const additions = [];
    const emitted = image?.emitted ?? null;
    // Without a file's lights only layers emit light.
    if (emitted !== null) material.emissive.setScalar(gloss.emission);
    else if (this.shine !== null) material.emissive.copy(this.own(part.rgb)).multiplyScalar(gloss.emission);
    if (isBlended || hasHoles) additions.push("diffuseColor.a = 1.0 - (1.0 - diffuseColor.a) * (1.0 - diffuseColor.a);");
    if (image) {
      this.cover(material, image, additions);
    } else if (pattern !== "plain") {
      this.draw(material, part, additions);
    } else {
      patch(material, additions);
    }
    return material;
  }

  /**
   * Makes the material of a part without its image or pattern.
   * @param {Part} part
   * @param {import("../message.js").Gloss} gloss
   * @param {{ vertexColors: boolean, alphaTest: number }} common
   * @returns {SurfaceMaterial}
   */
  plain(part, gloss, common) {
    if (this.shine !== null) return new MeshPhongMaterial({ ...common, ...this.highlights(part, gloss, this.shine) });
    if (!this.reflects) return new MeshLambertMaterial(common);
    return new MeshPhysicalMaterial({ ...common, roughness: roughnessOf(gloss), metalness: gloss.metallic, specularIntensity: Math.min(gloss.specular, 1) });
  }

  /**
   * Returns the highlights of a surface in a file's lights: of Blinn's and Phong's model, of which three.js draws
   * `specular * (shininess / 2 + 1) / 4` where MuJoCo draws the strength itself.
   * @param {Part} part
   * @param {import("../message.js").Gloss} gloss
   * @param {number} shine
   */
  highlights(part, gloss, shine) {
    const shininess = Math.max(gloss.shininess * SHININESS, 1);
    const tint = new Color(1, 1, 1).lerp(this.own(part.rgb), gloss.metallic);
    return { shininess, specular: tint.multiplyScalar((gloss.specular * shine * 4) / (shininess / 2 + 1)) };
  }

  /**
   * Covers a surface with an image. Until the image has arrived, it has the mean colour.
   * @param {SurfaceMaterial} material
   * @param {import("../message.js").SurfaceImage} image
   * @param {string[]} additions
   */
  async cover(material, image, additions) {
    material.color = this.own(this.textures.mean(image.texture));
    patch(material, additions);
    const isCube = image.mapping.kind === "cube";
    const numbers = (/** @type {number | null} */ number) => (number === null ? null : this.textures.numbers(number));
    // The lights of a file make no surface brighter than its image plus the emission of its layer.
    const glow = image.emitted === null ? "" : " + totalEmissiveRadiance";
    const most = (/** @type {string} */ rgb) => (this.shine === null ? "" : `outgoingLight = min(outgoingLight, ${rgb}${glow});`);
    try {
      const [texture, gloss, relief, emitted] = await Promise.all([
        isCube ? this.textures.cube(image.texture) : this.textures.colour(image.texture), isCube ? null : numbers(image.gloss), numbers(image.relief),
        isCube || image.emitted === null ? null : this.textures.colour(image.emitted)]);
      if (isCube) {
        const lines = ["vec4 ofCube = texture(cube, vPlace);", "diffuseColor *= ofCube;", ...additions];
        const uniforms = { cube: { value: texture } };
        patch(material, lines, { place: OF_MESH, before: "uniform samplerCube cube;", uniforms, last: most("ofCube.rgb") });
      } else {
        material.map = texture;
        patch(material, additions, { place: null, before: "", uniforms: {}, last: most("sampledDiffuseColor.rgb") });
      }
      if (relief) {
        material.normalMap = relief;
        // Directions of the surface come from the image's coordinates, which go down.
        material.normalScale.set(1, -1);
      }
      if (gloss && material instanceof MeshPhysicalMaterial) material.roughnessMap = material.metalnessMap = gloss;
      if (material.emissive.getHex() && !isCube) material.emissiveMap = emitted ?? texture;
      material.color.set(1, 1, 1);
      material.needsUpdate = true;
      this.changed();
    } catch (error) {
      // The mean colour stays.
      console.warn(error);
    }
  }

  /**
   * Draws a pattern between two colours.
   * @param {SurfaceMaterial} material
   * @param {Part} part
   * @param {string[]} additions
   */
  draw(material, { pattern, second_rgb: second }, additions) {
    if (pattern === "plain") return;
    // A share of linear light is another share of a file's values.
    const dark = this.shine === null ? PATTERNS[pattern].dark : PATTERNS[pattern].dark ** (1 / 2.2);
    const other = second ? "second" : "diffuseColor.rgb * second";
    const value = second ? this.own(second) : new Color(dark, dark, dark);
    const line = `diffuseColor.rgb = mix(diffuseColor.rgb, ${other}, patternShare(vPlace));`;
    // Tiles are in the ground plane of the world.
    const place = pattern === "checker" ? "(modelMatrix * vec4(transformed, 1.0)).xyz" : OF_MESH;
    patch(material, [line, ...additions], { place, before: `uniform vec3 second;\n${patternGlsl(pattern)}`, uniforms: { second: { value } }, last: "" });
  }
}

/**
 * Returns the roughness of a surface: the stated one, or the one with equally sharp highlights. Source: Walter et al. 2007, section 5.2.
 * @param {import("../message.js").Gloss} gloss
 */
function roughnessOf({ roughness, shininess }) {
  if (roughness !== null) return roughness;
  if (shininess === USUAL_GLOSS.shininess) return USUAL_ROUGHNESS;
  return (2 / (Math.max(shininess, 0) * SHININESS + 2)) ** 0.25;
}

/** Attribute of each corner: the point that a mapping or a pattern is a function of. */
const OF_MESH = "place";

/**
 * Adds lines to the material's program, after its colour is known.
 * @param {SurfaceMaterial} material
 * @param {string[]} lines
 * @param {{ place: string | null, before: string, uniforms: Record<string, { value: unknown }>, last: string }} [more] GLSL of the point
 *   `vPlace`, what goes before, and a line after all light is known.
 */
function patch(material, lines, { place, before, uniforms, last } = { place: null, before: "", uniforms: {}, last: "" }) {
  const varying = place ? "varying vec3 vPlace;" : "";
  material.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, uniforms);
    if (place) {
      const attribute = place === OF_MESH ? `attribute vec3 ${OF_MESH};` : "";
      shader.vertexShader = shader.vertexShader
        .replace("#include <common>", `#include <common>\n${varying}\n${attribute}`)
        .replace("#include <project_vertex>", `#include <project_vertex>\nvPlace = ${place};`);
    }
    shader.fragmentShader = shader.fragmentShader
      .replace("#include <common>", `#include <common>\n${varying}\n${before}`)
      .replace("#include <color_fragment>", `#include <color_fragment>\n${lines.join("\n")}`)
      .replace("#include <opaque_fragment>", `${last}\n#include <opaque_fragment>`);
  };
  material.customProgramCacheKey = () => [...lines, before, last].join("\n");
}

/**
 * Returns the axis along which a mesh is longest: a grain runs along it.
 * @param {MeshNumbers} mesh
 */
function longestAxis({ positions }) {
  const lengths = [0, 1, 2].map((axis) => {
    let [low, high] = [Infinity, -Infinity];
    for (let at = axis; at < positions.length; at += 3) [low, high] = [Math.min(low, positions[at]), Math.max(high, positions[at])];
    return Math.fround(high - low);
  });
  return lengths.indexOf(Math.max(...lengths));
}

/**
 * Returns the function from a point of a part's mesh to the point that its mapping or pattern depends on. Returns null if it depends
 * on no point, or on a point of the world.
 * @param {Part} part
 * @param {MeshNumbers} mesh
 * @returns {((own: number[]) => number[]) | null}
 */
function placing(part, mesh) {
  const { image, pattern } = part;
  if (image && image.mapping.kind === "cube") {
    const { scale_1_m: scale, centre_m: centre } = image.mapping;
    return (own) => own.map((value, axis) => scale[axis] * (value - centre[axis]));
  }
  if (image || pattern === "plain" || pattern === "checker") return null;
  const grain = pattern === "print" ? 0 : longestAxis(mesh);
  return (own) => [own[grain], own[(grain + 1) % 3], own[(grain + 2) % 3]];
}

/**
 * Returns the texture coordinates of a corner.
 * @param {import("../message.js").Mapping} mapping
 * @param {MeshNumbers} mesh
 * @param {number} corner
 * @returns {[number, number]}
 */
function uvOf(mapping, { positions, uvs }, corner) {
  if (mapping.kind !== "along") return uvs ? [uvs[2 * corner], uvs[2 * corner + 1]] : [0, 0];
  const along = (/** @type {0 | 1} */ axis) => mapping.scale_1_m[axis] * (positions[3 * corner + axis] - mapping.centre_m[axis]) - 0.5;
  return [along(0), along(1)];
}

/**
 * Returns parts of one carrier as one geometry in its frame, with their colours at the corners.
 * @param {Part[]} parts
 * @param {MeshNumbers[]} meshes
 * @param {(part: Part) => Color} paintOf
 */
function merged(parts, meshes, paintOf) {
  const total = parts.reduce((sum, part) => sum + meshes[part.mesh].positions.length, 0);
  const [positions, normals, colours] = [new Float32Array(total), new Float32Array(total), new Float32Array(total)];
  const indices = new Uint32Array(parts.reduce((sum, part) => sum + meshes[part.mesh].indices.length, 0));
  const [{ image }] = parts;
  const hasPlaces = placing(parts[0], meshes[parts[0].mesh]) !== null;
  const places = hasPlaces ? new Float32Array(total) : null;
  const uvs = image && !hasPlaces ? new Float32Array((2 * total) / 3) : null;
  const point = new Vector3();
  const shift = new Vector3();
  const turn = new Quaternion();
  let [first, filled] = [0, 0];
  for (const part of parts) {
    const mesh = meshes[part.mesh];
    const paint = paintOf(part);
    const placeOf = placing(part, mesh);
    const corners = mesh.positions.length / 3;
    turn.fromArray(part.pose, 3);
    shift.fromArray(part.pose);
    for (let corner = 0; corner < corners; corner += 1) {
      const at = 3 * (first + corner);
      point.fromArray(mesh.positions, 3 * corner).applyQuaternion(turn).add(shift).toArray(positions, at);
      if (places && placeOf) places.set(placeOf([...mesh.positions.subarray(3 * corner, 3 * corner + 3)]), at);
      if (uvs && part.image) uvs.set(uvOf(part.image.mapping, mesh, corner), 2 * (first + corner));
      point.set(mesh.normals[4 * corner], mesh.normals[4 * corner + 1], mesh.normals[4 * corner + 2]).normalize();
      point.applyQuaternion(turn).toArray(normals, at);
      paint.toArray(colours, at);
    }
    for (const corner of mesh.indices) indices[filled++] = first + corner;
    first += corners;
  }
  const geometry = new BufferGeometry();
  const attributes = { position: positions, normal: normals, color: colours, place: places };
  for (const [name, values] of Object.entries(attributes)) if (values) geometry.setAttribute(name, new BufferAttribute(values, 3));
  if (uvs) geometry.setAttribute("uv", new BufferAttribute(uvs, 2));
  geometry.setIndex(new BufferAttribute(indices, 1));
  return geometry;
}
