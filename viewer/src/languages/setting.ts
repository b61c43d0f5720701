/** Words of the panel that proposes problems, in each language. */

export type Miss = "grade" | "easy" | "moves" | "steepness" | "holds" | "reach" | "body";

export interface SettingWords {
  propose: string;
  wish: string;
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
  misses: Record<Miss, string>;
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

const en: SettingWords = {
  propose: "Propose",
  wish: "Wished:",
  hint: "Problems on the holds that hang, which stay on their routes. Climb one before you believe it.",
  from: "Grade from",
  to: "to",
  moves: "Moves of hands",
  any: "any",
  reach: "Reach",
  static: "all in reach",
  dynamic: "with a leap",
  kind: "Holds",
  kinds: { jugs: "jugs", crimps: "crimps", slopers: "slopers", pinches: "pinches", pockets: "pockets", small: "small", large: "large" },
  body: "Must get up",
  ask: "Search",
  others: "Search others",
  searching: "Searching, it takes some seconds …",
  make: "Make it a route",
  proposed: "Proposed by walltopo; nobody has climbed it yet.",
  climbed: "It was climbed",
  takeOff: "Take it off again",
  nothing: "Nothing was found. Another grade, another style?",
  fewer: "No more were found that differ from each other.",
  misses: {
    grade: "The middle of its grades is beside what you wished.",
    easy: "Easier than the model knows: its grades are open below.",
    moves: "Another number of moves.",
    steepness: "Most of its holds are on walls of another steepness.",
    holds: "Most of its holds are of another kind.",
    reach: "The reach is not as wished.",
    body: "Who must get up has to leap, or does not get up.",
  },
  noStart: "the start is out of reach",
  moveCount: (count) => `${count} moves`,
  easier: "One grade easier",
  harder: "One grade harder",
  doIt: "Do it",
  none: "No hold nearby does that.",
  shared: (route) => `It is of ${route}, too: climbers must be told.`,
  change: {
    "add a foothold": (hold) => `Foothold: ${hold}`,
    "add a handhold": (hold) => `Handhold: ${hold}`,
    "take away": (hold) => `Without: ${hold}`,
  },
  by: (grades, harder) => `about ${grades} grades ${harder ? "harder" : "easier"}`,
  crux: (percent) => `hardest move: ${Math.abs(percent)} % ${percent > 0 ? "less" : "more"} effort`,
  now: "Now",
};

const de: SettingWords = {
  propose: "Vorschlagen",
  wish: "Gewünscht:",
  hint: "Boulder aus den Griffen, die hängen; sie bleiben in ihren Routen. Klettere einen, bevor du ihm glaubst.",
  from: "Grad von",
  to: "bis",
  moves: "Züge der Hände",
  any: "egal",
  reach: "Reichweite",
  static: "alles in Reichweite",
  dynamic: "mit Sprung",
  kind: "Griffe",
  kinds: { jugs: "Henkel", crimps: "Leisten", slopers: "Sloper", pinches: "Zangen", pockets: "Löcher", small: "kleine", large: "große" },
  body: "Muss hochkommen",
  ask: "Suchen",
  others: "Andere suchen",
  searching: "Wird gesucht, das dauert einige Sekunden …",
  make: "Route daraus machen",
  proposed: "Von walltopo vorgeschlagen; noch niemand ist sie geklettert.",
  climbed: "Sie wurde geklettert",
  takeOff: "Wieder wegnehmen",
  nothing: "Nichts gefunden. Ein anderer Grad, ein anderer Stil?",
  fewer: "Mehr, die sich voneinander unterscheiden, wurden nicht gefunden.",
  misses: {
    grade: "Die Mitte der Grade liegt neben dem, was du wolltest.",
    easy: "Leichter, als das Modell es kennt: Die Grade sind nach unten offen.",
    moves: "Eine andere Zahl von Zügen.",
    steepness: "Die meisten Griffe sind an anders geneigter Wand.",
    holds: "Die meisten Griffe sind von anderer Art.",
    reach: "Die Reichweite ist nicht wie gewünscht.",
    body: "Wer hochkommen muss, muss springen oder kommt nicht hoch.",
  },
  noStart: "der Start ist außer Reichweite",
  moveCount: (count) => `${count} Züge`,
  easier: "Einen Grad leichter",
  harder: "Einen Grad schwerer",
  doIt: "Machen",
  none: "Kein Griff in der Nähe bewirkt das.",
  shared: (route) => `Gehört auch zu ${route}: Das muss den Kletternden gesagt werden.`,
  change: {
    "add a foothold": (hold) => `Tritt: ${hold}`,
    "add a handhold": (hold) => `Griff: ${hold}`,
    "take away": (hold) => `Ohne: ${hold}`,
  },
  by: (grades, harder) => `etwa ${grades} Grade ${harder ? "schwerer" : "leichter"}`,
  crux: (percent) => `schwerster Zug: ${Math.abs(percent)} % ${percent > 0 ? "weniger" : "mehr"} Kraft`,
  now: "Jetzt",
};

const cs: SettingWords = {
  propose: "Navrhnout",
  wish: "Přání:",
  hint: "Bouldery z chytů, které visí; zůstanou ve svých cestách. Než návrhu uvěříte, přelezte ho.",
  from: "Obtížnost od",
  to: "do",
  moves: "Kroky rukou",
  any: "jakékoli",
  reach: "Dosah",
  static: "vše v dosahu",
  dynamic: "se skokem",
  kind: "Chyty",
  kinds: { jugs: "madla", crimps: "lišty", slopers: "oblíny", pinches: "stisky", pockets: "dírky", small: "malé", large: "velké" },
  body: "Musí vylézt",
  ask: "Hledat",
  others: "Hledat jiné",
  searching: "Hledá se, trvá to několik sekund …",
  make: "Vytvořit cestu",
  proposed: "Navrhl walltopo; zatím ji nikdo nepřelezl.",
  climbed: "Byla přelezena",
  takeOff: "Zase odebrat",
  nothing: "Nic se nenašlo. Jiná obtížnost, jiný styl?",
  fewer: "Další, které by se od sebe lišily, se nenašly.",
  misses: {
    grade: "Střed obtížností je vedle toho, co jste chtěli.",
    easy: "Lehčí, než model zná: obtížnosti jsou dole otevřené.",
    moves: "Jiný počet kroků.",
    steepness: "Většina chytů je na stěně s jiným sklonem.",
    holds: "Většina chytů je jiného druhu.",
    reach: "Dosah není podle přání.",
    body: "Kdo musí vylézt, musí skočit, nebo nevyleze.",
  },
  noStart: "start je mimo dosah",
  moveCount: (count) => `kroků: ${count}`,
  easier: "O stupeň lehčí",
  harder: "O stupeň těžší",
  doIt: "Provést",
  none: "Žádný chyt poblíž to nezpůsobí.",
  shared: (route) => `Patří i do ${route}: lezci to musí vědět.`,
  change: {
    "add a foothold": (hold) => `Stup: ${hold}`,
    "add a handhold": (hold) => `Chyt: ${hold}`,
    "take away": (hold) => `Bez: ${hold}`,
  },
  by: (grades, harder) => `asi o ${grades} stupně ${harder ? "těžší" : "lehčí"}`,
  crux: (percent) => `nejtěžší krok: o ${Math.abs(percent)} % ${percent > 0 ? "méně" : "více"} síly`,
  now: "Nyní",
};

const fr: SettingWords = {
  propose: "Proposer",
  wish: "Souhait :",
  hint: "Des blocs avec les prises en place, qui restent dans leurs voies. Grimpez-en un avant d'y croire.",
  from: "Cotation de",
  to: "à",
  moves: "Mouvements de mains",
  any: "peu importe",
  reach: "Allonge",
  static: "tout à portée",
  dynamic: "avec un jeté",
  kind: "Prises",
  kinds: { jugs: "bacs", crimps: "réglettes", slopers: "plats", pinches: "pinces", pockets: "trous", small: "petites", large: "grandes" },
  body: "Doit pouvoir grimper",
  ask: "Chercher",
  others: "En chercher d'autres",
  searching: "Recherche, cela prend quelques secondes …",
  make: "En faire une voie",
  proposed: "Proposée par walltopo ; personne ne l'a encore grimpée.",
  climbed: "Elle a été grimpée",
  takeOff: "La retirer",
  nothing: "Rien n'a été trouvé. Une autre cotation, un autre style ?",
  fewer: "Pas d'autres qui diffèrent entre elles.",
  misses: {
    grade: "Le milieu des cotations est à côté de votre souhait.",
    easy: "Plus facile que ce que le modèle connaît : les cotations sont ouvertes vers le bas.",
    moves: "Un autre nombre de mouvements.",
    steepness: "La plupart des prises sont sur un mur d'une autre inclinaison.",
    holds: "La plupart des prises sont d'un autre genre.",
    reach: "L'allonge n'est pas celle souhaitée.",
    body: "Qui doit grimper doit sauter, ou n'arrive pas en haut.",
  },
  noStart: "le départ est hors de portée",
  moveCount: (count) => `${count} mouvements`,
  easier: "Une cotation plus facile",
  harder: "Une cotation plus dure",
  doIt: "Le faire",
  none: "Aucune prise proche ne fait cela.",
  shared: (route) => `Elle est aussi dans ${route} : il faut le dire aux grimpeurs.`,
  change: {
    "add a foothold": (hold) => `Pied : ${hold}`,
    "add a handhold": (hold) => `Main : ${hold}`,
    "take away": (hold) => `Sans : ${hold}`,
  },
  by: (grades, harder) => `environ ${grades} cotations plus ${harder ? "dure" : "facile"}`,
  crux: (percent) => `mouvement le plus dur : ${Math.abs(percent)} % d'effort ${percent > 0 ? "en moins" : "en plus"}`,
  now: "Maintenant",
};

export const setting = { en, de, cs, fr };
