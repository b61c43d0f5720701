import createClient from "openapi-fetch";

/** Returns a client of a gym's server; `token` is one of a person or of an app. */
export function createGym(address, { token, headers, ...options } = {}) {
  const authorization = token ? { authorization: `Bearer ${token}` } : {};
  return createClient({ baseUrl: address, headers: { ...authorization, ...headers }, ...options });
}
