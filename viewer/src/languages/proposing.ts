/** Words of the panel that proposes problems, in each language. */

/** A request of the spec that a proposed problem does not meet. */
export type Violation = "grade" | "easy" | "moves" | "steepness" | "holds" | "reach" | "body";

export interface ProposalWords {
  propose: string;
  target: string;
  hint: string;
  from: string;
  to: string;
  moves: string;
  any: string;
  reach: string;
  static: string;
  dynamic: string;
  kind: string;
  kinds: Record<"jugs" | "crimps" | "slopers" | "pinches" | "pockets" | "small" | "large", string>;
  body: string;
  ask: string;
  others: string;
  searching: string;
  make: string;
  /** On the card of a route that is one. */
  proposed: string;
  climbed: string;
  takeOff: string;
  nothing: string;
  fewer: string;
  misses: Record<Violation, string>;
  noStart: string;
  moveCount: (count: number) => string;
  easier: string;
  harder: string;
  doIt: string;
  none: string;
  shared: (route: string) => string;
  change: Record<"add a foothold" | "add a handhold" | "take away", (hold: string) => string>;
  by: (grades: string, harder: boolean) => string;
  crux: (percent: number) => string;
  now: string;
}

const en: ProposalWords = {
  propose: "Propose",
  target: "Target:",
  hint: "Problems on the current holds; routes keep their holds. Climb a problem before you trust its grade.",
  from: "Grade from",
  to: "to",
  moves: "Hand moves",
  any: "any",
  reach: "Reach",
  static: "static",
  dynamic: "dynamic",
  kind: "Holds",
  kinds: { jugs: "jugs", crimps: "crimps", slopers: "slopers", pinches: "pinches", pockets: "pockets", small: "small", large: "large" },
  body: "Must be possible for",
  ask: "Search",
  others: "More proposals",
  searching: "Searching; this takes a few seconds…",
  make: "Create route",
  proposed: "Proposed by walltopo; nobody has climbed it yet.",
  climbed: "Mark as climbed",
  takeOff: "Discard proposal",
  nothing: "No proposals found. Try another grade or style.",
  fewer: "No other distinct proposals found.",
  misses: {
    grade: "The estimated grade is off the target.",
    easy: "Easier than the grade model covers.",
    moves: "The number of moves differs.",
    steepness: "Most of its holds are on walls of another steepness.",
    holds: "Most of its holds are of another kind.",
    reach: "The reach differs from the target.",
    body: "The chosen body must leap, or cannot climb it.",
  },
  noStart: "the start is out of reach",
  moveCount: (count) => `${count} moves`,
  easier: "One grade easier",
  harder: "One grade harder",
  doIt: "Do it",
  none: "No hold nearby does that.",
  shared: (route) => `It is also a hold of ${route}: tell climbers.`,
  change: {
    "add a foothold": (hold) => `Foothold: ${hold}`,
    "add a handhold": (hold) => `Handhold: ${hold}`,
    "take away": (hold) => `Without: ${hold}`,
  },
  by: (grades, harder) => `about ${grades} grades ${harder ? "harder" : "easier"}`,
  crux: (percent) => `hardest move: ${Math.abs(percent)}% ${percent > 0 ? "less" : "more"} effort`,
  now: "Now",
};

const de: ProposalWords = {
  propose: "Vorschlagen",
  target: "Ziel:",
  hint: "Boulder auf den aktuellen Griffen; Routen behalten ihre Griffe. Klettere einen Boulder, bevor du seinem Grad vertraust.",
  from: "Grad von",
  to: "bis",
  moves: "Handzüge",
  any: "egal",
  reach: "Reichweite",
  static: "statisch",
  dynamic: "dynamisch",
  kind: "Griffe",
  kinds: { jugs: "Henkel", crimps: "Leisten", slopers: "Sloper", pinches: "Zangen", pockets: "Löcher", small: "kleine", large: "große" },
  body: "Muss möglich sein für",
  ask: "Suchen",
  others: "Weitere Vorschläge",
  searching: "Suche läuft; das dauert ein paar Sekunden …",
  make: "Route erstellen",
  proposed: "Von walltopo vorgeschlagen; noch niemand ist sie geklettert.",
  climbed: "Als geklettert markieren",
  takeOff: "Vorschlag verwerfen",
  nothing: "Keine Vorschläge gefunden. Versuche einen anderen Grad oder Stil.",
  fewer: "Keine weiteren verschiedenen Vorschläge gefunden.",
  misses: {
    grade: "Der geschätzte Grad weicht vom Ziel ab.",
    easy: "Leichter, als das Gradmodell abdeckt.",
    moves: "Die Zahl der Züge weicht ab.",
    steepness: "Die meisten Griffe sind an Wänden mit anderer Neigung.",
    holds: "Die meisten Griffe sind von anderer Art.",
    reach: "Die Reichweite weicht vom Ziel ab.",
    body: "Die gewählte Person muss springen oder schafft es nicht.",
  },
  noStart: "der Start ist außer Reichweite",
  moveCount: (count) => `${count} Züge`,
  easier: "Einen Grad leichter",
  harder: "Einen Grad schwerer",
  doIt: "Übernehmen",
  none: "Kein Griff in der Nähe hilft dabei.",
  shared: (route) => `Gehört auch zu ${route}: Weise darauf hin.`,
  change: {
    "add a foothold": (hold) => `Tritt: ${hold}`,
    "add a handhold": (hold) => `Griff: ${hold}`,
    "take away": (hold) => `Ohne: ${hold}`,
  },
  by: (grades, harder) => `etwa ${grades} Grade ${harder ? "schwerer" : "leichter"}`,
  crux: (percent) => `schwerster Zug: ${Math.abs(percent)} % ${percent > 0 ? "weniger" : "mehr"} Kraft`,
  now: "Jetzt",
};

const cs: ProposalWords = {
  propose: "Navrhnout",
  target: "Cíl:",
  hint: "Bouldery na aktuálních chytech; cestám jejich chyty zůstávají. Než obtížnosti uvěříte, boulder vylezte.",
  from: "Obtížnost od",
  to: "do",
  moves: "Kroky rukou",
  any: "jakékoli",
  reach: "Dosah",
  static: "staticky",
  dynamic: "dynamicky",
  kind: "Chyty",
  kinds: { jugs: "madla", crimps: "lišty", slopers: "obliny", pinches: "stisky", pockets: "dírky", small: "malé", large: "velké" },
  body: "Musí zvládnout",
  ask: "Hledat",
  others: "Další návrhy",
  searching: "Hledá se; trvá to několik sekund…",
  make: "Vytvořit cestu",
  proposed: "Navrhl walltopo; zatím ji nikdo nepřelezl.",
  climbed: "Označit jako vylezenou",
  takeOff: "Zahodit návrh",
  nothing: "Žádné návrhy. Zkuste jinou obtížnost nebo styl.",
  fewer: "Další odlišné návrhy nenalezeny.",
  misses: {
    grade: "Odhad obtížnosti se liší od cíle.",
    easy: "Lehčí, než model obtížnosti pokrývá.",
    moves: "Počet kroků se liší.",
    steepness: "Většina chytů je na stěnách s jiným sklonem.",
    holds: "Většina chytů je jiného druhu.",
    reach: "Dosah se liší od cíle.",
    body: "Zvolená postava musí skočit, nebo to nevyleze.",
  },
  noStart: "start je mimo dosah",
  moveCount: (count) => `kroků: ${count}`,
  easier: "O stupeň lehčí",
  harder: "O stupeň těžší",
  doIt: "Provést",
  none: "Žádný chyt poblíž tomu nepomůže.",
  shared: (route) => `Patří i do ${route}: lezci to musí vědět.`,
  change: {
    "add a foothold": (hold) => `Stup: ${hold}`,
    "add a handhold": (hold) => `Chyt: ${hold}`,
    "take away": (hold) => `Bez: ${hold}`,
  },
  by: (grades, harder) => `asi o ${grades} stupně ${harder ? "těžší" : "lehčí"}`,
  crux: (percent) => `nejtěžší krok: o ${Math.abs(percent)} % ${percent > 0 ? "méně" : "více"} síly`,
  now: "Nyní",
};

const fr: ProposalWords = {
  propose: "Proposer",
  target: "Objectif :",
  hint: "Blocs sur les prises actuelles ; les voies gardent leurs prises. Grimpez un bloc avant de croire sa cotation.",
  from: "Cotation de",
  to: "à",
  moves: "Mouvements des mains",
  any: "peu importe",
  reach: "Allonge",
  static: "statique",
  dynamic: "dynamique",
  kind: "Prises",
  kinds: { jugs: "bacs", crimps: "réglettes", slopers: "plats", pinches: "pinces", pockets: "trous", small: "petites", large: "grandes" },
  body: "Doit être possible pour",
  ask: "Chercher",
  others: "Autres propositions",
  searching: "Recherche ; cela prend quelques secondes…",
  make: "Créer une voie",
  proposed: "Proposée par walltopo ; personne ne l’a encore grimpée.",
  climbed: "Marquer comme grimpée",
  takeOff: "Rejeter la proposition",
  nothing: "Aucune proposition. Essayez une autre cotation ou un autre style.",
  fewer: "Aucune autre proposition distincte.",
  misses: {
    grade: "La cotation estimée s’écarte de l’objectif.",
    easy: "Plus facile que ce que couvre le modèle.",
    moves: "Le nombre de mouvements diffère.",
    steepness: "La plupart des prises sont sur des murs d’une autre inclinaison.",
    holds: "La plupart des prises sont d’un autre type.",
    reach: "L’allonge s’écarte de l’objectif.",
    body: "La personne choisie doit sauter ou ne peut pas le grimper.",
  },
  noStart: "le départ est hors de portée",
  moveCount: (count) => `${count} mouvements`,
  easier: "Une cotation plus facile",
  harder: "Une cotation plus dure",
  doIt: "Appliquer",
  none: "Aucune prise proche ne convient.",
  shared: (route) => `Elle est aussi dans ${route} : il faut le dire aux grimpeurs.`,
  change: {
    "add a foothold": (hold) => `Pied : ${hold}`,
    "add a handhold": (hold) => `Main : ${hold}`,
    "take away": (hold) => `Sans : ${hold}`,
  },
  by: (grades, harder) => `environ ${grades} cotations plus ${harder ? "dure" : "facile"}`,
  crux: (percent) => `mouvement le plus dur : ${Math.abs(percent)} % d’effort ${percent > 0 ? "en moins" : "en plus"}`,
  now: "Maintenant",
};

export const proposing = { en, de, cs, fr };
