/** The server's messages about competitions; names for types that several files use. */

import type { Schemas } from "../api/client";

export type Sheet = Schemas["CompetitionSheet"];
export type Listed = Schemas["CompetitionFacts"];
export type Format = Sheet["format"];
export type State = Sheet["state"];
export type Category = Schemas["CategoryFacts"];
export type Problem = Schemas["ProblemFacts"];
export type Round = Schemas["RoundFacts"];
export type Scoring = Schemas["ScoringBody"];
export type RuleName = Scoring["rules"];
export type Entry = Schemas["EntryFacts"];
export type Starter = Schemas["StarterFacts"];
/** A score event; this browser learns the server's fields later. */
export type Scored = Pick<Schemas["EventFacts"], "id" | "entry_id" | "problem_id" | "kind" | "n" | "target_id" | "text" | "made_at"> & { by_name?: string };
export type Board = Schemas["BoardView"];
export type RoundHead = Schemas["RoundHead"];
export type Line = Schemas["Line"];
export type RoundLine = Schemas["RoundLine"];
export type Team = Schemas["Team"];
