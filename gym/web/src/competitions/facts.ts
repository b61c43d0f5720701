/** What the server says of competitions; names for the types that more than one file here uses. */

export type Format = "festival" | "rounds" | "league" | "night";
export type State = "draft" | "open" | "running" | "ended";
export type RuleName = "points" | "shared" | "ifsc-2025" | "ifsc-2018" | "most";

export interface Scoring { rules: RuleName; flash?: number; top?: number; zone?: number; best?: number | null }
export interface Category { id: string; name: string; gender: "" | "women" | "men" | "other"; born_from: number | null; born_to: number | null }
export interface Problem {
  id: string; label: string; route_id: string | null; name: string; colour: string; grade: string; wall: string;
  points: { flash: number; top: number; zone: number } | null; category_ids: string[];
}
export interface Round {
  id: string; name: string; kind: "open" | "qualification" | "semi" | "final" | "week"; state: "waiting" | "running" | "ended";
  scoring: Scoring; quota: number | null; opens_at: string | null; closes_at: string | null; problems: Problem[];
}
export interface Sheet {
  id: string; name: string; format: Format; state: State; about: string; fee: string; waiver: string; starts_at: string | null; ends_at: string | null;
  self_entry: boolean; self_scoring: boolean; late_minutes: number; league_best: number | null; team_size: number | null;
  frozen_at: string | null; revision: number; gym_time_zone: string; categories: Category[]; rounds: Round[]; entries: number; entered: boolean;
}
export interface Listed { id: string; name: string; format: Format; state: State; starts_at: string | null; ends_at: string | null; about: string; fee: string; self_entry: boolean; entries: number }
export interface Entry {
  id: string; category_id: string; name: string; bib: number; team: string; club: string; birth_year: number | null; gender: string;
  handicap: number; person_id: string | null; withdrawn: boolean; waiver_at: string | null;
}
export interface Scored {
  id: string; seq?: number; entry_id: string; problem_id: string | null; kind: "attempt" | "zone" | "top" | "void" | "out" | "appeal" | "decision";
  n: number | null; target_id: string | null; text: string; made_at: string; at?: string; by_name?: string;
}
export interface RoundLine { round_id: string; rank: number | null; started: boolean; points: string; tops: number; zones: number; flashes: number; tries_to_top: number; tries_to_zone: number; marks: Record<string, [number, number, number]> }
export interface Line { entry_id: string; bib: number; name: string; team: string; club: string; rank: number | null; tied: boolean; out: string | null; points: string; rounds: RoundLine[] }
export interface Team { rank: number; tied: boolean; name: string; points: string; members: string[] }
export interface RoundHead { id: string; name: string; kind: string; state: string; rules: RuleName; problems: { id: string; label: string; colour: string }[] }
export interface Board {
  competition_id: string; name: string; state: State; format: Format; frozen_at: string | null; seq: number; revision: number; at: string | null;
  rounds: RoundHead[]; categories: { id: string; name: string; lines: Line[] }[]; teams: Team[];
}
export interface Starter { category_id: string; place: number; entry_id: string; bib: number; name: string }
export interface Order { first: string; second: string; before: string; steps: { code: string; round_id: string | null; first: string; second: string; decides: boolean }[] }
