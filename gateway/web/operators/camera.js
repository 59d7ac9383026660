// Where a point in the pelvis frame lies in the robot's picture, and back. Quaternions are [w, x, y, z]; the camera looks along z, y down.

export function rotate([w, x, y, z], [a, b, c]) {
  const [s, t, u] = [2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)];
  return [a + w * s + y * u - z * t, b + w * t + z * s - x * u, c + w * u + x * t - y * s];
}

const inverse = ([w, x, y, z]) => [w, -x, -y, -z];

/** Pixels and depth of a point; the depth is never less than what a lens sees. */
export function project(camera, pointM) {
  const { position_m: at, quaternion_wxyz: turned } = camera.camera_in_pelvis;
  const [x, y, z] = rotate(inverse(turned), pointM.map((value, axis) => value - at[axis]));
  const depthM = Math.max(z, 0.1);
  return { u: camera.fx * x / depthM + camera.cx, v: camera.fy * y / depthM + camera.cy, depthM };
}

/** How far a point at `depthM` moves in the pelvis frame where its picture moves by (du, dv), and it goes away by `awayM`. */
export function moved(camera, depthM, du, dv, awayM) {
  return rotate(camera.camera_in_pelvis.quaternion_wxyz, [du * depthM / camera.fx, dv * depthM / camera.fy, awayM]);
}
