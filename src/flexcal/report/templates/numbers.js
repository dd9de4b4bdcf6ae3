"use strict";
// Arrays of a figure's specification: plain, or base64 with the type of their numbers.
function flexcalNumbers(array) {
  if (!array || !array.bdata) return array || [];
  const types = { i1: Int8Array, u1: Uint8Array, i2: Int16Array, u2: Uint16Array, i4: Int32Array, u4: Uint32Array, f4: Float32Array, f8: Float64Array };
  return new types[array.dtype](Uint8Array.from(atob(array.bdata), (letter) => letter.charCodeAt(0)).buffer);
}
