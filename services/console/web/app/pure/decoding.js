// Whether this browser can decode the drone's video, which is H.264 and nothing else.

/** A decoder that has been given video for so long without a single picture has failed. */
export const STUCK_MS = 5000;

/**
 * Whether the codecs of `RTCRtpReceiver.getCapabilities("video")` hold H.264. A browser that does not tell is believed to have it:
 * it is found out when it answers.
 */
export function hasH264(capabilities) {
  if (!Array.isArray(capabilities?.codecs)) return true;
  return capabilities.codecs.some(({ mimeType }) => /^video\/h264$/i.test(mimeType ?? ""));
}

/** Whether a session description takes H.264. */
export function takesH264(sdp) {
  return /^a=rtpmap:\d+ H264\//im.test(sdp ?? "");
}

/** Sees by a receiver's counters when its decoder has failed. */
export class Decoder {
  constructor() {
    this.bytes = 0;
    this.decoded = 0;
    /** Since when video has come and no picture of it. */
    this.since = null;
  }
  /** Takes the counters of `inbound-rtp`; true when the decoder is stuck. */
  isStuck({ bytesReceived, framesDecoded }, now) {
    const bytes = Number.isFinite(bytesReceived) ? bytesReceived : 0;
    const decoded = Number.isFinite(framesDecoded) ? framesDecoded : 0;
    const fed = bytes > this.bytes;
    const moved = decoded !== this.decoded;
    this.bytes = bytes;
    this.decoded = decoded;
    if (moved || !fed) this.since = null;
    else this.since ??= now;
    return this.since !== null && now - this.since >= STUCK_MS;
  }
}
