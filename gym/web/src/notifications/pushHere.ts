/** Push notifications in this browser. */

import { answer, api, ApiError } from "../api/client";
import { t } from "../i18n.svelte";

export const canPush = "PushManager" in window && "serviceWorker" in navigator && "Notification" in window;

async function manager(): Promise<PushManager> {
  return (await navigator.serviceWorker.ready).pushManager;
}

/** This browser's push address, if it has one. */
export async function ownEndpoint(): Promise<string> {
  return (await (await manager()).getSubscription())?.endpoint ?? "";
}

/** Subscribe this browser; `key`: the server's public push key. Returns the push address. */
export async function subscribe(key: string): Promise<string> {
  if ((await Notification.requestPermission()) !== "granted") throw new ApiError(0, t("news.denied"));
  let own: PushSubscription;
  try {
    own = await (await manager()).subscribe({ userVisibleOnly: true, applicationServerKey: key });
  } catch {
    throw new ApiError(0, t("news.failed"));
  }
  const { keys } = own.toJSON();
  await answer(api.PUT("/api/v1/me/push", { body: { endpoint: own.endpoint, public_key: keys!["p256dh"]!, secret: keys!["auth"]! } }));
  return own.endpoint;
}

export async function unsubscribe(): Promise<void> {
  await (await (await manager()).getSubscription())?.unsubscribe();
}
