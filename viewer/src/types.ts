/** Rows of `holds.json` and `routes.json`, as the scan wrote them. */

export interface Hold {
  id: number;
  class: string;
  type: string | null;
  colour: string | null;
  colour_rgb: [number, number, number] | null;
  position: [number, number, number];
  normal: [number, number, number];
  size_m: number | null;
  area_m2: number | null;
  steepness_deg: number | null;
  score: number;
  route: number | null;
  review?: boolean;
  role?: string;
  photos?: string[];
  /** Its picture, of a hold that an edit shaped. */
  cutout?: string;
  /** Why it is no hold, of an instance that the editor shows although it is none. */
  left_out?: string;
}

export interface Route {
  id: number;
  name?: string;
  colour: string | null;
  holds: number[];
  length_m: number | null;
  steepness_deg: number | null;
  start?: number[];
  top?: number[];
  zone?: number[];
  footholds?: number[];
  /** Given by a setter; `date` is ISO. */
  grade?: string;
  setter?: string;
  description?: string;
  date?: string;
  /** Why someone should have a look. */
  doubtful_start?: string;
  doubtful_top?: string;
  /** By walltopo, and climbed by nobody yet. */
  proposed?: boolean;
}

export interface Tables {
  title: string;
  metric: boolean;
  holds: Map<number, Hold>;
  routes: Map<number, Route>;
}

export type Vec3 = [number, number, number];
