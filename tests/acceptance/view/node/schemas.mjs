// Compares our messages with Foxglove's .proto files from @foxglove/schemas: package and names must be equal, and each of our
// fields must have the same number, type and plurality. Fields that we lack are not reported.
import { createRequire } from 'node:module';
import { isDeepStrictEqual } from 'node:util';

const require = createRequire(import.meta.url);
const { foxgloveEnumSchemas, foxgloveMessageSchemas, generateProto } = require('@foxglove/schemas/internal');
const protobuf = require('protobufjs');

export function foxgloveTypes() {
  const root = new protobuf.Root();
  for (const schema of Object.values(foxgloveMessageSchemas)) {
    if (schema.protoEquivalent) continue;  // Timestamp and Duration are Google's
    const enums = Object.values(foxgloveEnumSchemas).filter((one) => one.parentSchemaName === schema.name);
    protobuf.parse(generateProto(schema, enums), root, { keepCase: true });
  }
  for (const name of ['timestamp', 'duration']) root.addJSON(protobuf.common.get(`google/protobuf/${name}.proto`).nested);
  return root.resolveAll();
}

export const typesOfFile = (file) => new protobuf.Root().loadSync(file, { keepCase: true }).resolveAll();

// Types and enumerations of the package, by full name.
function* membersOf(namespace) {
  for (const one of namespace.nestedArray) {
    if (one instanceof protobuf.Type || one instanceof protobuf.Enum) yield one;
    if (one.nestedArray) yield* membersOf(one);
  }
}

const shapeOf = (field) => ({
  number: field.id,
  type: field.resolvedType?.fullName ?? field.type,
  repeated: field.repeated,
});

// Returns the differences as text, and the number of compared fields.
export function compare(ours, theirs) {
  const differences = [];
  let fields = 0;
  const expect = (what, mine, other) => {
    if (!isDeepStrictEqual(mine, other)) differences.push(`${what}: ours ${JSON.stringify(mine)}, theirs ${JSON.stringify(other)}`);
  };
  for (const one of membersOf(ours.lookup('foxglove'))) {
    const other = theirs.lookup(one.fullName);
    expect(one.fullName, one.constructor.name, other?.constructor.name);
    if (!other) continue;
    for (const name of Object.keys(one.values ?? {})) expect(`${one.fullName}.${name}`, one.values[name], other.values[name]);
    for (const field of one.fieldsArray ?? []) {
      ++fields;
      expect(field.fullName, shapeOf(field), other.fields[field.name] && shapeOf(other.fields[field.name]));
    }
  }
  return { differences, fields };
}
