:- module(test_probe,
          [ describe/2,                 % +Term, -Description
            runaway/1                   % ?Depth
          ]).

/** <module> What tests ask Prolog about the terms that came over the bridge
*/

%!  describe(+Term, -Description) is det.
%
%   Description says in JSON what Term is, with texts as lists of character codes, so that nothing is
%   lost or mended on the way back.

describe(Term, _{variable: true}) :-
    var(Term),
    !.
describe(Term, _{list: Items}) :-
    is_list(Term),
    !,
    maplist(describe, Term, Items).
describe(Term, _{compound: Codes, arguments: Described}) :-
    compound(Term),
    !,
    compound_name_arguments(Term, Name, Arguments),
    name_codes(Name, Codes),
    maplist(describe, Arguments, Described).
describe(Term, _{integer: Text}) :-
    integer(Term),
    !,
    format(string(Text), "~d", [Term]).
describe(Term, _{float: Text}) :-
    float(Term),
    !,
    format(string(Text), "~q", [Term]).
describe(Term, _{atom: Codes}) :-
    atom(Term),
    name_codes(Term, Codes).

name_codes(Name, Codes) :-
    atom(Name),
    atom_codes(Name, Codes).

%!  runaway(?Depth) is det.
%
%   Needs more stack than there is: the recursive call is not the last one.

runaway(s(Depth)) :-
    runaway(Depth),
    ground(Depth).
