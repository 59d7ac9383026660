// Text for the wearer of a headset, on a board below the line of sight: the state of the episode and of the hands, and the remaining budget.

import { CanvasTexture, Mesh, MeshBasicMaterial, NoColorSpace, PlaneGeometry, SRGBColorSpace } from "three";

const WIDTH_M = 0.9;
const PIXELS = [1024, 192];
const LINE_PIXELS = 44;
/** Place before the eyes; the board is tilted towards them. */
const PLACE_M = [0, -0.52, -0.95];
const TILT_RAD = -0.5;

/** The board of one wearer. */
export class Board {
  /**
   * @param {import("three").Group} rig The space of the wearer.
   * @param {boolean} isLitByFile True in a scene whose colours are not linear light.
   */
  constructor(rig, isLitByFile) {
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = PIXELS;
    this.paper = canvas.getContext("2d");
    this.texture = new CanvasTexture(canvas);
    this.text = "";
    this.texture.colorSpace = isLitByFile ? NoColorSpace : SRGBColorSpace;
    // The board is drawn over all objects at its place, for example a table.
    const material = new MeshBasicMaterial({ map: this.texture, transparent: true, depthTest: false });
    const board = new Mesh(new PlaneGeometry(WIDTH_M, (WIDTH_M * PIXELS[1]) / PIXELS[0]), material);
    board.position.fromArray(PLACE_M);
    board.rotation.x = TILT_RAD;
    board.renderOrder = 10;
    rig.add(board);
  }

  /** Shows lines. A line that is too long continues in the next. @param {string[]} lines */
  say(lines) {
    const text = lines.join("\n");
    const { paper } = this;
    if (text === this.text || !paper) return;
    this.text = text;
    const [width, height] = PIXELS;
    paper.clearRect(0, 0, width, height);
    paper.fillStyle = "rgba(20, 24, 30, 0.7)";
    paper.fillRect(0, 0, width, height);
    paper.fillStyle = "#ffffff";
    paper.font = `${0.75 * LINE_PIXELS}px system-ui, sans-serif`;
    lines.flatMap((line) => broken(paper, line, width - LINE_PIXELS)).forEach((line, index) => {
      paper.fillText(line, LINE_PIXELS / 2, LINE_PIXELS * (index + 1));
    });
    this.texture.needsUpdate = true;
  }
}

/**
 * Breaks a line into lines that fit the width.
 * @param {CanvasRenderingContext2D} paper
 * @param {string} line
 * @param {number} width
 */
function broken(paper, line, width) {
  const lines = [];
  let current = "";
  for (const word of line.split(" ")) {
    const longer = current ? `${current} ${word}` : word;
    if (current && paper.measureText(longer).width > width) {
      lines.push(current);
      current = word;
    } else {
      current = longer;
    }
  }
  return [...lines, current];
}
