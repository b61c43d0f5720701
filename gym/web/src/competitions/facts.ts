/** What the server says of competitions; names for the types that more than one file here uses. */

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
/** A score event, of which this browser knows the server's part only later. */
export type Scored = Pick<Schemas["EventFacts"], "id" | "entry_id" | "problem_id" | "kind" | "n" | "target_id" | "text" | "made_at"> & { by_name?: string };
export type Board = Schemas["BoardTold"];
export type RoundHead = Schemas["RoundHead"];
export type Line = Schemas["Line"];
export type RoundLine = Schemas["RoundLine"];
export type Team = Schemas["Team"];
