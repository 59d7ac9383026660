"""Motion of boxes that slide on their base, without a simulator: reference for the scenes `box_slides` and `arm_pushes_box`.

The base is rigid and stands on four springs of equal stiffness: its pressure is linear, and its moments balance those of the
friction below the centre of mass. Every corner rubs after Coulomb. MuJoCo at short steps and with stiff contacts makes these
boxes hop by a millimetre while they slide, and then they stop elsewhere; our own physics at ever shorter steps comes to this.
"""

import math

import numpy as np

DT_S = 1e-5
# Below this speed friction falls off, so that the equations stay smooth.
CREEP_M_S = 2e-4
CREEP_RAD_S = 1e-3
# Of the fist against the box: under 10 N it gives by a tenth of a millimetre.
STIFFNESS_N_M = 1e5
DAMPING_N_S_M = 300.0


class Box:
    """A box on the floor: its pose in the plane, and the friction of its base."""

    def __init__(self, model, name, qpos, qvel):
        body = model.body(name)
        geom = model.geom(body.geomadr[0])
        self.gravity_m_s2 = -model.opt.gravity[2]
        self.mass_kg, self.inertia_kg_m2 = float(body.mass[0]), float(body.inertia[2])
        self.half_x_m, self.half_y_m, self.half_z_m = map(float, geom.size)
        # The floor is the first geom of both scenes; the larger coefficient counts.
        self.friction = float(max(geom.friction[0], model.geom(0).friction[0]))
        self.x_m, self.y_m, self.turn_rad = float(qpos[0]), float(qpos[1]), 0.0
        self.vx_m_s, self.vy_m_s, self.spin_rad_s = float(qvel[0]), float(qvel[1]), float(qvel[5])
        self.rub_n = (0.0, 0.0)

    def advance(self, push_x_n=0.0, push_y_n=0.0, push_n_m=0.0):
        """One step under a push at half the box's height, moment about its centre."""
        c, s = math.cos(self.turn_rad), math.sin(self.turn_rad)
        # The friction of the last step: it changes slowly.
        lean_x_n = c * self.rub_n[0] + s * self.rub_n[1]
        lean_y_n = c * self.rub_n[1] - s * self.rub_n[0]
        fx = fy = moment = 0.0
        for side_x in (-1.0, 1.0):
            for side_y in (-1.0, 1.0):
                press = self.mass_kg * self.gravity_m_s2
                press -= self.half_z_m * (lean_x_n * side_x / self.half_x_m + lean_y_n * side_y / self.half_y_m)
                x, y = side_x * self.half_x_m, side_y * self.half_y_m
                rx, ry = c * x - s * y, s * x + c * y
                ux, uy = self.vx_m_s - self.spin_rad_s * ry, self.vy_m_s + self.spin_rad_s * rx
                share = self.friction * max(press / 4.0, 0.0) / math.sqrt(ux * ux + uy * uy + CREEP_M_S**2)
                fx -= share * ux
                fy -= share * uy
                moment -= share * (rx * uy - ry * ux)
        self.rub_n = (fx, fy)
        self.vx_m_s += DT_S * (fx + push_x_n) / self.mass_kg
        self.vy_m_s += DT_S * (fy + push_y_n) / self.mass_kg
        self.spin_rad_s += DT_S * (moment + push_n_m) / self.inertia_kg_m2
        self.x_m += DT_S * self.vx_m_s
        self.y_m += DT_S * self.vy_m_s
        self.turn_rad += DT_S * self.spin_rad_s

    def place(self):
        return [self.x_m, self.y_m, self.half_z_m]

    def heading(self):
        return [math.cos(self.turn_rad), math.sin(self.turn_rad), 0.0]


class Arm:
    """Two upright hinges under position targets, and a ball as fist."""

    def __init__(self, model, key):
        upper, fore = model.body("upper_arm"), model.body("forearm")
        fist = model.geom("fist")
        self.upper_m, self.fore_m, self.fist_m = float(fore.pos[0]), float(fist.pos[0]), float(fist.size[0])
        centre_m = float(fore.ipos[0])
        self.fore_kg_m = float(fore.mass[0]) * centre_m
        # Of slender links that lie along x, the largest principal moment is the upright one.
        self.fore_kg_m2 = float(max(fore.inertia)) + self.fore_kg_m * centre_m
        self.upper_kg_m2 = float(max(upper.inertia)) + float(upper.mass[0]) * float(upper.ipos[0]) ** 2
        self.upper_kg_m2 += float(fore.mass[0]) * self.upper_m**2
        self.armature_kg_m2 = [float(armature) for armature in model.dof_armature[:2]]
        self.dry_n_m = [float(dry) for dry in model.dof_frictionloss[:2]]
        self.kp_n_m_rad = [float(gain[0]) for gain in model.actuator_gainprm[:2]]
        self.kd_n_m_s_rad = [-float(bias[2]) for bias in model.actuator_biasprm[:2]]
        self.most_n_m = [float(limit[1]) for limit in model.actuator_forcerange[:2]]
        self.target_rad = [float(target) for target in key.ctrl]
        self.q_rad = [float(q) for q in key.qpos[:2]]
        self.v_rad_s = [0.0, 0.0]

    def fist(self):
        """Place of the fist, its velocity, and the place of the elbow."""
        (q1, q2), (v1, v2) = self.q_rad, self.v_rad_s
        elbow = (self.upper_m * math.cos(q1), self.upper_m * math.sin(q1))
        reach = (self.fore_m * math.cos(q1 + q2), self.fore_m * math.sin(q1 + q2))
        velocity = (-elbow[1] * v1 - reach[1] * (v1 + v2), elbow[0] * v1 + reach[0] * (v1 + v2))
        return (elbow[0] + reach[0], elbow[1] + reach[1]), velocity, elbow

    def advance(self, at, force_n, elbow):
        """One step under a force on the fist."""
        (v1, v2), bend = self.v_rad_s, self.q_rad[1]
        torque = [self.drive(0) + at[0] * force_n[1] - at[1] * force_n[0],
                  self.drive(1) + (at[0] - elbow[0]) * force_n[1] - (at[1] - elbow[1]) * force_n[0]]
        lever = self.fore_kg_m * self.upper_m
        torque[0] += lever * math.sin(bend) * (2.0 * v1 * v2 + v2 * v2)
        torque[1] -= lever * math.sin(bend) * v1 * v1
        a22 = self.fore_kg_m2 + self.armature_kg_m2[1]
        a12 = self.fore_kg_m2 + lever * math.cos(bend)
        a11 = self.upper_kg_m2 + self.fore_kg_m2 + 2.0 * lever * math.cos(bend) + self.armature_kg_m2[0]
        determinant = a11 * a22 - a12 * a12
        self.v_rad_s = [v1 + DT_S * (a22 * torque[0] - a12 * torque[1]) / determinant,
                        v2 + DT_S * (a11 * torque[1] - a12 * torque[0]) / determinant]
        self.q_rad = [q + DT_S * v for q, v in zip(self.q_rad, self.v_rad_s)]

    def drive(self, joint):
        v = self.v_rad_s[joint]
        wanted = self.kp_n_m_rad[joint] * (self.target_rad[joint] - self.q_rad[joint]) - self.kd_n_m_s_rad[joint] * v
        most = self.most_n_m[joint]
        return max(-most, min(most, wanted)) - self.dry_n_m[joint] * v / math.sqrt(v * v + CREEP_RAD_S**2)


def touch(box, arm, friction):
    """The point in which the fist touches the box, and the force on the fist."""
    (fx, fy), (vx, vy), _ = arm.fist()
    c, s = math.cos(box.turn_rad), math.sin(box.turn_rad)
    dx, dy = fx - box.x_m, fy - box.y_m
    in_x, in_y = c * dx + s * dy, c * dy - s * dx
    near_x = max(-box.half_x_m, min(box.half_x_m, in_x))
    near_y = max(-box.half_y_m, min(box.half_y_m, in_y))
    away = math.hypot(in_x - near_x, in_y - near_y)
    at = (box.x_m + c * near_x - s * near_y, box.y_m + s * near_x + c * near_y)
    if not 0.0 < away < arm.fist_m:
        return at, (0.0, 0.0)
    normal = ((fx - at[0]) / away, (fy - at[1]) / away)
    turning = sum(arm.v_rad_s)
    slip_x = vx - turning * (at[1] - fy) - box.vx_m_s + box.spin_rad_s * (at[1] - box.y_m)
    slip_y = vy + turning * (at[0] - fx) - box.vy_m_s - box.spin_rad_s * (at[0] - box.x_m)
    parting = slip_x * normal[0] + slip_y * normal[1]
    along = slip_y * normal[0] - slip_x * normal[1]
    press = max(0.0, STIFFNESS_N_M * (arm.fist_m - away) - DAMPING_N_S_M * parting)
    rub = -friction * press * along / math.sqrt(along * along + CREEP_M_S**2)
    return at, (press * normal[0] - rub * normal[1], press * normal[1] + rub * normal[0])


def box_slides(model, seconds, hz):
    key = model.key("start")
    boxes = [Box(model, "straight", key.qpos[:7], key.qvel[:6]), Box(model, "turning", key.qpos[7:], key.qvel[6:])]

    def advance():
        for box in boxes:
            box.advance()

    return sampled(seconds, hz, advance, lambda: [*boxes[0].place(), *boxes[1].place(), *boxes[1].heading()])


def arm_pushes_box(model, seconds, hz):
    key = model.key("start")
    arm, box = Arm(model, key), Box(model, "box", key.qpos[2:], key.qvel[2:])
    friction = float(max(model.geom("fist").friction[0], box.friction))

    def advance():
        at, force_n = touch(box, arm, friction)
        arm.advance(at, force_n, arm.fist()[2])
        moment = (at[1] - box.y_m) * force_n[0] - (at[0] - box.x_m) * force_n[1]
        box.advance(-force_n[0], -force_n[1], moment)

    return sampled(seconds, hz, advance, lambda: [*arm.q_rad, *box.place(), *box.heading()])


def sampled(seconds, hz, advance, read):
    """Readings at a rate, from 0 s to the end: samples x numbers, like those of the scene's sensors."""
    every = round(1.0 / (hz * DT_S))
    samples = [read()]
    for _ in range(round(seconds * hz)):
        for _ in range(every):
            advance()
        samples.append(read())
    return np.array(samples)
