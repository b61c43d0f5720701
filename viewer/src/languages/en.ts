/** English: the language that the others are measured by. */

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
  counted: Record<"route" | "hold" | "volume", Forms>;
  words: typeof words;
  /** Sentences with something in them. */
  holdName: (colour: string, type: string) => string;
  holdLine: (id: number, where: string) => string;
  overhang: (degrees: number) => string;
  slab: (degrees: number) => string;
  percent: (share: number) => string;
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
  chosen: "Chosen",
  picture: "The wall in 3D. Arrow keys turn, plus and minus zoom, brackets step through the routes.",
  home: "Whole wall",
  climber: "View as a climber",
  measure: "Measure",
  share: "Copy a link to this view",
  save: "Save a picture",
  start: "Start",
  top: "Top",
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
  steep: "Steep, 35° and more",
  noColour: "no colour",
  noneFits: "No route fits the filters.",
  noRoutes: "No routes were found among the holds.",
  noHolds: "No holds were found on this wall.",
  showList: "Show the list",
  hideList: "Hide the list",
  loading: "Loading",
  loadingWall: "Loading the wall …",
  settingUp: "Setting it up …",
  sorry: "Sorry",
  again: "Try again",
  noWebGl: "This browser cannot draw in 3D (WebGL 2 is missing or switched off).",
  noWorker: "this page does not let the viewer start a worker (worker-src blob: in its content policy)",
  noSource: "No model was given: set the src attribute.",
  tooLarge: "the model is larger than this browser has memory for",
  interrupted: "The graphics were interrupted …",
  restored: "Restored.",
  secondPoint: "Tap the second point.",
  twoPoints: "Tap two points on the wall.",
  copied: "Link copied.",
  inAddress: "The link to this view is in the address bar.",
  noPicture: "The picture could not be made.",
  twoFingers: "Use two fingers to move the wall.",
  clickFirst: "Click the wall to zoom with the wheel.",
};

export const en: Language = {
  code: "en",
  colours: {},
  types: {},
  counted: {
    route: { one: "route", other: "routes" },
    hold: { one: "hold", other: "holds" },
    volume: { one: "volume", other: "volumes" },
  },
  words,
  holdName: (colour, type) => `${colour} ${type}`.trim(),
  holdLine: (id, where) => `Hold ${id} · ${where}`,
  overhang: (degrees) => `${degrees}° overhang`,
  slab: (degrees) => `${degrees}° slab`,
  percent: (share) => `${share} %`,
  failed: (why) => `The wall could not be loaded: ${why}.`,
  finerFailed: (why) => `The finer model did not load: ${why}`,
};
