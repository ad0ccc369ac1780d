# Plain comments as Doxygen wants them: the first is about the file, whole lines are about what follows, trailing ones about what
# precedes; declarations without a blank line between them share a comment.
{
  line = $0
  isComment = line ~ /^ *\/\/( |$)/
  if (NR == 1) sub(/^\/\/ /, "/// \\file\n/// ", line)
  else if (isComment) sub(/\/\//, "///", line)
  else if (line ~ /[;,)] +\/\/ /) sub(/ +\/\/ /, " ///< ", line)

  if (isComment) gsub(/#/, "\\#", line)
  if (isComment) shared = wasComment ? shared "\n" line : line
  else if (line == "") shared = ""
  else if (endedDeclaration && line ~ /^[A-Za-z[]/) line = shared "\n" line
  wasComment = isComment
  endedDeclaration = $0 ~ /[;}]( +\/\/.*)?$/
  print line
}
