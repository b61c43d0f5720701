/** A climber of a few bones: where joints are in a stance, and what is drawn of it. */

import { CapsuleGeometry, Group, Mesh, MeshLambertMaterial, Quaternion, SphereGeometry, Vector3 } from "three";

/** Joints of a stance, in the scan's units. */
export interface Pose {
  hip: Vector3;
  /** Hands, then feet; left first. */
  ends: [Vector3, Vector3, Vector3, Vector3];
  /** Out of the wall, unit. */
  out: Vector3;
}

// Shares of the height: Drillis & Contini (1966), as walltopo/climbing/body.py has them.
const ARM = [0.186, 0.254] as const;
const LEG = [0.245, 0.285] as const;
const TORSO = 0.288;
const SHOULDER = 0.129;
const PELVIS = 0.075;
const HEAD = 0.066;
const UP = new Vector3(0, 0, 1);
const SKIN = "#e8b48e";
const SHIRT = "#2f6fed";
const TROUSERS = "#2b3340";

interface Bone {
  mesh: Mesh<CapsuleGeometry, MeshLambertMaterial>;
  length: number;
}

export class Figure {
  readonly root = new Group();
  private readonly bones: Record<string, Bone>;
  private readonly head: Mesh<SphereGeometry, MeshLambertMaterial>;

  /** `height` and `span` in the scan's units. */
  constructor(
    private readonly height: number,
    private readonly span: number,
  ) {
    const thick = (share: number): number => share * height;
    const bone = (colour: string, share: number): Bone => {
      const geometry = new CapsuleGeometry(thick(share), 1, 6, 12);
      const mesh = new Mesh(geometry, new MeshLambertMaterial({ color: colour }));
      this.root.add(mesh);
      return { mesh, length: 1 };
    };
    this.bones = { torso: bone(SHIRT, 0.062), shoulders: bone(SHIRT, 0.045), pelvis: bone(TROUSERS, 0.058) };
    for (const side of ["left", "right"]) {
      this.bones[`${side} upper arm`] = bone(SHIRT, 0.03);
      this.bones[`${side} forearm`] = bone(SKIN, 0.024);
      this.bones[`${side} thigh`] = bone(TROUSERS, 0.043);
      this.bones[`${side} shin`] = bone(TROUSERS, 0.032);
    }
    this.head = new Mesh(new SphereGeometry(HEAD * height, 20, 16), new MeshLambertMaterial({ color: SKIN }));
    this.root.add(this.head);
  }

  pose({ hip, ends, out }: Pose): void {
    const { height } = this;
    const [left, right] = [ends[0], ends[1]];
    const reach = (ARM[0] + ARM[1]) * height + (this.span - height) / 2;
    const middle = left.clone().add(right).multiplyScalar(0.5);
    // Upright as far as the hands allow, along the wall where it leans.
    const lean = middle.clone().sub(hip).normalize().multiplyScalar(0.7).addScaledVector(UP, 0.5);
    const chest = hip.clone().addScaledVector(lean.normalize(), TORSO * height);
    const side = new Vector3().crossVectors(UP, out).normalize();
    // The shoulders turn with hands that are far apart in height.
    const reached = right.clone().sub(left);
    const axis = side.clone().multiplyScalar(1.6).addScaledVector(reached.normalize(), 0.7).normalize();
    const shoulders = [-1, 1].map((sign) => chest.clone().addScaledVector(axis, sign * SHOULDER * height));
    this.nearer(shoulders, ends, reach, chest);
    const hips = [-1, 1].map((sign) => hip.clone().addScaledVector(side, sign * PELVIS * height));
    this.put("torso", hip, chest);
    this.put("shoulders", shoulders[0]!, shoulders[1]!);
    this.put("pelvis", hips[0]!, hips[1]!);
    for (const [k, name] of ["left", "right"].entries()) {
      const sign = k * 2 - 1;
      const down = out.clone().multiplyScalar(0.5).addScaledVector(UP, -0.8).addScaledVector(side, sign * 0.6);
      this.limb([`${name} upper arm`, `${name} forearm`], shoulders[k]!, ends[k]!, ARM, reach / (ARM[0] + ARM[1]), down);
      const outward = out.clone().addScaledVector(side, sign * 0.8).addScaledVector(UP, 0.35);
      this.limb([`${name} thigh`, `${name} shin`], hips[k]!, ends[k + 2]!, LEG, height, outward);
    }
    const neck = chest.clone().addScaledVector(lean, 0.115 * height);
    this.head.position.copy(neck);
  }

  dispose(): void {
    for (const { mesh } of Object.values(this.bones)) {
      mesh.geometry.dispose();
      mesh.material.dispose();
    }
    this.head.geometry.dispose();
    this.head.material.dispose();
  }

  /** Shoulders go towards a hand that they do not reach. */
  private nearer(shoulders: Vector3[], ends: Pose["ends"], reach: number, chest: Vector3): void {
    for (const k of [0, 1]) {
      const gap = ends[k]!.clone().sub(shoulders[k]!);
      const lack = gap.length() - reach;
      if (lack <= 0) continue;
      const by = gap.setLength(lack);
      chest.addScaledVector(by, 0.5);
      for (const shoulder of shoulders) shoulder.addScaledVector(by, 0.5);
      shoulders[k]!.addScaledVector(by, 0.5);
    }
  }

  /** Two bones from `root` to `end`; the joint between bends towards `towards`. */
  private limb(
    names: [string, string],
    root: Vector3,
    end: Vector3,
    shares: readonly [number, number],
    height: number,
    towards: Vector3,
  ): void {
    const [a, b] = [shares[0] * height, shares[1] * height];
    const line = end.clone().sub(root);
    const length = Math.min(Math.max(line.length(), Math.abs(a - b) * 1.02), (a + b) * 0.999);
    line.normalize();
    const along = (a * a - b * b + length * length) / (2 * length);
    const off = Math.sqrt(Math.max(a * a - along * along, 0));
    const bend = towards.clone().addScaledVector(line, -towards.dot(line)).normalize();
    const joint = root.clone().addScaledVector(line, along).addScaledVector(bend, off);
    this.put(names[0], root, joint);
    this.put(names[1], joint, root.clone().addScaledVector(line, length));
  }

  private put(name: string, from: Vector3, to: Vector3): void {
    const bone = this.bones[name]!;
    const { mesh } = bone;
    const line = to.clone().sub(from);
    const length = Math.max(line.length(), 1e-6);
    mesh.position.copy(from).addScaledVector(line, 0.5);
    mesh.quaternion.copy(new Quaternion().setFromUnitVectors(new Vector3(0, 1, 0), line.normalize()));
    if (Math.abs(length - bone.length) < 1e-4 * length) return;
    const { radius } = mesh.geometry.parameters;
    mesh.geometry.dispose();
    mesh.geometry = new CapsuleGeometry(radius, length, 6, 12);
    bone.length = length;
  }
}
