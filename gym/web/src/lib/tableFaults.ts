/** The errors of an imported table by line, in the reader's language. */

import { ApiError, type Schemas } from "../api/client";

export interface TableFault {
  line: number;
  column: string;
  why: ApiError;
}

export function tableFaults(errors: Schemas["FaultOut"][] = []): TableFault[] {
  return errors.map(({ line, column, why, ...codes }) => ({ line, column, why: ApiError.from(422, { ...codes, title: why }) }));
}
