:- module(planner_outset,
          [ outset/2                    % +Session, -Dict
          ]).

/** <module> What a plan begins with, told to the independent checker

The checker shares no code with what makes plans, but it has to know what is left of a request that is
under way: the remaining program as a term, and what the situation holds.
*/

:- use_module(library(assoc)).
:- use_module(library(lists)).
:- use_module(library(apply)).
:- use_module(kb_rules(facts), [kind/3]).
:- use_module(planner_golog(projection)).
:- use_module(planner_golog(sessions)).

%!  outset(+Session, -Dict) is det.
%
%   Of the session as it is looked ahead from. Terms are told as {f: Functor, a: Arguments}, {v: Number}
%   for a variable, lists and atomic values as they are.

outset(Session, _{program: Program, began: Began, fluents: Fluents, truths: Truths, running: Running, held: Held,
                  claimed: Claimed, team: Team, worked: Worked, excluded: Excluded, places: Places}) :-
    ahead_of(Session, P0, S),
    copy_term(P0, P),
    numbervars(P, 0, _),
    told(P, Program),
    began(S, Began),
    team(S, Team),
    running(S, Runs),
    findall([End|Row], ( member(run(End, Agents, Id, Head), Runs), action_row(Id, Head, Agents, Row) ), Running),
    findall([Property, Subject, Value],
            ( known_pair(S, Property-Subject, Value0), Property \== held, told(Value0, Value) ),
            Fluents),
    findall([Place, Value], ( known_pair(S, loc(F, N), Value), atomic_list_concat([F, /, N], Place) ), Truths),
    findall([Robot, Id], known_pair(S, held-Robot, Id), Held),
    findall([Resource, Ids], known_pair(S, claimed(Resource), Ids), Claimed),
    findall([Robot, Ms], known_pair(S, worked(Robot), Ms), Worked),
    findall([Pick, X], known_pair(S, excluded(Pick, X), true), Excluded),
    revision(S, Revision),
    findall([Robot, Place], ( kind(Revision, Robot, 'Robot'), fluent_value(locatedAt, Robot, Place, S) ), Places).

told(Term, Told) :-
    (   is_list(Term)
    ->  maplist(told, Term, Told)
    ;   Term = '$VAR'(N)
    ->  Told = _{v: N}
    ;   compound(Term)
    ->  compound_name_arguments(Term, Functor, Arguments0),
        maplist(told, Arguments0, Arguments),
        Told = _{f: Functor, a: Arguments}
    ;   Told = Term
    ).
