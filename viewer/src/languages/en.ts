/** English: the language that the others are measured by. */

import type { Vision } from "../data/colour_vision";
import { proposing } from "./proposing";
import type { ProposalWords } from "./proposing";

export interface Forms {
  one: string;
  few?: string;
  other: string;
}

export interface Language {
  code: string;
  /** Names of colours and of types of holds; others are shown as the scan wrote them. */
  colours: Record<string, string>;
  types: Record<string, string>;
  /** Why something is left out, by what the scan says. */
  reasons: Record<string, string>;
  /** Why a route's start or top may be another one, by what the scan says. */
  doubts: Record<string, string>;
  /** Why an entry of the log does nothing, by the server's key; numbers go into the braces. */
  notes: Record<string, string>;
  /** Reasons of the server's refusals, by its key. */
  problems: Record<string, string>;
  counted: Record<"route" | "hold" | "volume", Forms>;
  words: typeof words;
  edit: typeof edit & {
    marked: (count: number) => string;
    unreadable: (why: string) => string;
    unshown: (why: string) => string;
    notSaved: (why: string) => string;
    notWritten: (why: string) => string;
    without: (entry: number, why: string) => string;
  };
  proposing: ProposalWords;
  /** Sentences with something in them. */
  visions: Record<Vision | "usual", string>;
  people: Record<"child" | "short" | "adult" | "tall" | "you" | "clip", string>;
  limbs: Record<"start" | "left hand" | "right hand" | "left foot" | "right foot", string>;
  leap: (length: string) => string;
  unreached: string;
  gradeRange: (low: string, high: string, graded: number) => string;
  holdName: (colour: string, type: string) => string;
  holdLine: (id: number, where: string) => string;
  overhang: (degrees: number) => string;
  slab: (degrees: number) => string;
  percent: (share: number) => string;
  answered: (status: number) => string;
  noTwin: (file: string) => string;
  emptyTwin: (file: string) => string;
  failed: (why: string) => string;
  finerFailed: (why: string) => string;
}

const words = {
  route: "Route",
  wall: "Wall",
  vertical: "vertical",
  units: "units",
  unknown: "unknown",
  routes: "Routes",
  view: "View",
  chosen: "Selected",
  picture: "The wall in 3D. Arrow keys turn, plus and minus zoom, brackets step through the routes. Shift with an arrow key goes from hold to hold, Enter selects, and once more leads to its card.",
  home: "Whole wall",
  climber: "View as a climber",
  measure: "Measure",
  share: "Copy a link to this view",
  save: "Save a picture",
  start: "Start",
  top: "Top",
  zone: "Zone",
  foot: "Foot",
  hand: "Hand",
  colour: "Colour",
  type: "Type",
  size: "Size",
  steepness: "Steepness",
  volume: "Volume",
  hold: "hold",
  previous: "Previous route",
  next: "Next route",
  showAll: "Show all routes",
  backToRoute: "Back to the route",
  close: "Close",
  everyRoute: "part of every route",
  climbDown: "for climbing down",
  noRoute: "on no route",
  allRoutes: "All routes",
  filter: "Filter the routes",
  filterSteepness: "Filter by steepness",
  anySteepness: "Any steepness",
  slab: "Slab",
  overhang: "Overhang",
  steep: "Steep, 35° or more",
  noColour: "no colour",
  noneFits: "No routes match the filters.",
  noRoutes: "No routes were found among the holds.",
  noHolds: "No holds were found on this wall.",
  showList: "Show the list",
  hideList: "Hide the list",
  loading: "Loading",
  loadingWall: "Loading the wall…",
  settingUp: "Preparing…",
  sorry: "Sorry",
  again: "Try again",
  noWebGl: "This browser cannot draw in 3D (WebGL 2 is missing or switched off).",
  noWorker: "this page does not let the viewer start a worker (worker-src blob: in its content policy)",
  noSource: "No model was given: set the src attribute.",
  tooLarge: "the model needs more memory than this browser has",
  interrupted: "The graphics were interrupted…",
  restored: "Restored.",
  secondPoint: "Tap the second point.",
  twoPoints: "Tap two points on the wall.",
  copied: "Link copied.",
  inAddress: "The link to this view is in the address bar.",
  noPicture: "The picture could not be made.",
  twoFingers: "Use two fingers to move the wall.",
  clickFirst: "Click the wall to zoom with the wheel.",
  noAnswer: "walltopo view does not respond",
  mayGo: "Suggested moves",
  play: "Play",
  pause: "Pause",
  moveBack: "Previous move",
  moveOn: "Next move",
  climberIs: "Climber",
  crux: "the hardest move",
  holdsInOrder: "Holds in order",
  beside: "beside the wall",
  colourVision: "Colour vision",
  noGlb: "the file is not a GLB",
  noSurface: "the file contains no mesh",
  noLabels: "the wall’s labels cannot be read",
};

/** Texts of the editor. */
const edit = {
  edit: "Edit",
  undo: "Undo",
  redo: "Redo",
  save: "Save",
  check: "Check",
  checkHint: "The next hold or route with low confidence",
  add: "Add a hold",
  addHint: "Tap the wall where a hold is missing.",
  addVolume: "Add a volume",
  addVolumeHint: "Tap a volume that is missing.",
  several: "Select several",
  paint: "Paint",
  erase: "Erase",
  hide: "Hide",
  hideHint: "Draw over a person or anything that nobody may see. Tap a hidden place to show it again.",
  leftOut: "Left out",
  leftOutHint: "The scan found these but did not count them as holds. Dots on the wall show where they are.",
  brush: "Brush, cm",
  route: "Route",
  none: "none",
  role: "Role in its route",
  class: "Class",
  oneHold: "hold",
  secondColour: "Second colour",
  notAHold: "Not a hold",
  cut: "Split",
  right: "Confirm",
  name: "Name",
  grade: "Grade",
  setter: "Setter",
  date: "Set on",
  merge: "Merge with",
  choose: "choose…",
  description: "Description",
  bringBack: "Restore as hold",
  markedHint: "Tap holds to select or deselect them.",
  makeRoute: "Create route",
  join: "Merge into one hold",
  toRoute: "Add to route",
  photos: "Photos of this place",
  noPhotos: "No photo shows this place.",
  photo: "Photo of this place",
  cutFirst: "Tap the hold where the split starts.",
  cutSecond: "Tap where the split ends.",
  chooseFirst: "Select the hold to paint first.",
  saving: "Saving…",
  writing: "Saved; updating the pages…",
  written: "All changes saved",
};

export const en: Language = {
  code: "en",
  colours: {},
  types: {},
  reasons: {},
  doubts: {},
  notes: {},
  problems: {},
  counted: {
    route: { one: "route", other: "routes" },
    hold: { one: "hold", other: "holds" },
    volume: { one: "volume", other: "volumes" },
  },
  words,
  edit: {
    ...edit,
    marked: (count) => (count === 1 ? "1 hold selected" : `${count} holds selected`),
    unreadable: (why) => `The edits cannot be read: ${why}. Saving is not possible.`,
    unshown: (why) => `The preview failed: ${why}`,
    notSaved: (why) => `Not saved: ${why}`,
    notWritten: (why) => `Saved, but the pages could not be updated: ${why}`,
    without: (entry, why) => `Edit ${entry} was skipped: ${why}`,
  },
  proposing: proposing.en,
  visions: { usual: "usual", protan: "weak red (protan)", deutan: "weak green (deutan)", tritan: "weak blue (tritan)", none: "no colours" },
  people: { child: "Child", short: "Short adult", adult: "Adult", tall: "Tall adult", you: "You", clip: "Your clip" },
  limbs: {
    start: "Start",
    "left hand": "Left hand",
    "right hand": "Right hand",
    "left foot": "Left foot",
    "right foot": "Right foot",
  },
  leap: (length) => `${length} beyond reach: a leap`,
  unreached: "the top is out of reach",
  gradeRange: (low, high, graded) =>
    `about ${low} to ${high}, ${graded ? `by ${graded} grades of this wall` : "guessed from a training board"}`,
  holdName: (colour, type) => `${colour} ${type}`.trim(),
  holdLine: (id, where) => `Hold ${id} · ${where}`,
  overhang: (degrees) => `${degrees}° overhang`,
  slab: (degrees) => `${degrees}° slab`,
  percent: (share) => `${share}%`,
  answered: (status) => `the server responded with ${status}`,
  noTwin: (file) => `${file} is missing beside the page`,
  emptyTwin: (file) => `${file} contains no model`,
  failed: (why) => `The wall could not be loaded: ${why}.`,
  finerFailed: (why) => `The finer model did not load: ${why}`,
};
