/** Passkeys in this browser, by SimpleWebAuthn; its script is fetched when one is used. */

import { answer, api, ApiError, type Schemas } from "../api/client";
import { t } from "../i18n.svelte";

type Library = typeof import("@simplewebauthn/browser");

export const canPasskeys = typeof window.PublicKeyCredential === "function";

/** The device's response. Throws a `ApiError` if its owner refused, or the device failed. */
async function requested<T>(use: (library: Library) => Promise<T>): Promise<T> {
  const library = await import("@simplewebauthn/browser");
  try {
    return await use(library);
  } catch (error) {
    if (!(error instanceof Error)) throw error;
    // A device that has this account's passkey already says InvalidStateError.
    const twice = error.name === "InvalidStateError";
    throw new ApiError(0, t(twice ? "passkeys.twice" : "passkeys.not"), twice ? "" : t("passkeys.notHint"));
  }
}

export async function addPasskey(name: string): Promise<void> {
  const optionsJSON = (await answer(api.POST("/api/v1/me/passkeys/options"))) as never;
  const credential = await requested((library) => library.startRegistration({ optionsJSON }));
  await answer(api.POST("/api/v1/me/passkeys", { body: { name, credential: { ...credential } } }));
}

async function signedChallenge(): Promise<Schemas["SignedChallenge"]> {
  const optionsJSON = (await answer(api.POST("/api/v1/session/passkey/options"))) as never;
  const credential = await requested((library) => library.startAuthentication({ optionsJSON }));
  return { credential: { ...credential } };
}

export async function signInByPasskey(): Promise<Schemas["Me"]> {
  return answer(api.POST("/api/v1/session/passkey", { body: await signedChallenge() }));
}

export async function confirmByPasskey(): Promise<void> {
  await answer(api.POST("/api/v1/me/confirm/passkey", { body: await signedChallenge() }));
}
