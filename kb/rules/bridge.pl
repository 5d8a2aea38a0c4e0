:- module(kb_bridge, [bridge/4]).

/** <module> The Prolog side of kb/prolog.py

Reads the argument of an entry from text, calls it, writes its answer as JSON. Whatever goes wrong
comes back as an answer too: nothing is thrown across the border.
*/

:- use_module(library(http/json), [json_write_dict/3]).

%!  bridge(+Module:string, +Entry:string, +Text:string, -Answer:string) is det.
%
%   Calls Module:Entry(Term, Dict), where Term is what Text says.
%   Answer is {"ok": Dict} or {"error": [Functor, Argument, ...], "message": Text}.

bridge(ModuleName, EntryName, Text, Answer) :-
    atom_string(Module, ModuleName),
    atom_string(Entry, EntryName),
    catch(answer(Module:Entry, Text, Dict), Error, error_dict(Error, Dict)),
    with_output_to(string(Answer), json_write_dict(current_output, Dict, [width(0)])).

answer(Goal, Text, _{ok: Dict}) :-
    term_string(Term, Text),
    (   call(Goal, Term, Dict0)
    ->  Dict = Dict0
    ;   throw(error(entry_failed(Goal), _))
    ).

error_dict(Error, _{error: Formal, message: Message}) :-
    (   Error = error(Term, _) -> true ; Term = Error ),
    (   compound(Term)
    ->  compound_name_arguments(Term, Functor, Arguments)
    ;   Functor = Term, Arguments = []
    ),
    maplist(written, [Functor|Arguments], Formal),
    message_to_codes_string(Error, Message).

written(Term, String) :-
    format(string(String), "~q", [Term]).

message_to_codes_string(Error, String) :-
    message_to_lines(Error, Lines),
    with_output_to(string(String0), print_message_lines(current_output, '', Lines)),
    normalize_space(string(String), String0).

message_to_lines(Error, Lines) :-
    '$messages':translate_message(Error, Lines, []).
