/** The upload of a backup to an empty server, with its progress, which `fetch` does not report. */

import { ApiError } from "../api/client";

/** Sends a file; `progress` gets the share that is sent. */
export function upload(file: File, code: string, progress: (share: number) => void): Promise<void> {
  return new Promise((resolve, reject) => {
    const request = new XMLHttpRequest();
    request.open("PUT", "/api/v1/setup/backup");
    request.setRequestHeader("x-walltopo-setup", code);
    request.upload.onprogress = ({ loaded, total }) => progress(total ? loaded / total : 0);
    request.onerror = () => reject(ApiError.unreachable());
    request.onload = () => (request.status === 204 ? resolve() : reject(refusal(request)));
    request.send(file);
  });
}

function refusal({ status, responseText }: XMLHttpRequest): ApiError {
  try {
    return ApiError.from(status, JSON.parse(responseText));
  } catch {
    return ApiError.from(status, null);
  }
}
