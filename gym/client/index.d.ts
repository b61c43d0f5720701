import type { Client, ClientOptions } from "openapi-fetch";
import type { components, paths } from "./schema.js";

export type { components, paths };

/** Bodies of requests and responses by name. */
export type Schemas = components["schemas"];

export type GymOptions = Omit<ClientOptions, "baseUrl"> & {
  /** A token of a person or of an app. */
  token?: string;
};

/** Returns a client of a gym's server, whose calls have the types of its API. */
export function createGym(address: string, options?: GymOptions): Client<paths>;
