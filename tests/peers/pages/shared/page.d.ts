// What the scripts put into the pages that they try.
export {};

declare global {
  /** Header of the scene that a page has heard. */
  type Head = any;
  /** A step that a page has heard, and when it came and was drawn, in milliseconds. */
  type Row = { came: number; row: Float32Array; drawn: number | null };

  interface Window {
    head: Head;
    rows: Row[];
    /** Times of moves of the pointer. */
    moves: number[];
    measured: Promise<{ rowMs: number; drawnMs: number; handleMs: number }>;
    /** Number of pictures that the page has drawn. */
    drawn: number;
    /** Whether pictures for the headset are drawn. */
    drawing: boolean;
    pad: object | null;
    /** Emulated headset of iwer, and the library. */
    device: any;
    IWER: any;
    axe: typeof import("axe-core");
    posesIn: typeof import("./rows.mjs").posesIn;
  }
}
